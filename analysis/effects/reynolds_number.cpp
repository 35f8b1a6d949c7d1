// Blades at low Reynolds number lose lift.
#include "analysis/air.h"
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

/// ρ Ω/μ: radius and chord cancel in Re / Re0, and need not be known. Viscosity by Sutherland; the density at
/// 101325 Pa where the pressure was not measured.
double reynolds_per_length2(std::span<const double> x) {
  const double kelvin = x[1] + kZeroCelsius_K;
  const double pressure_Pa = x.size() > 2 ? x[2] : 101325.0;
  return dry_air_density_kg_m3(pressure_Pa, kelvin) * x[0] / air_viscosity_Pa_s(kelvin);
}

struct ReynoldsNumber {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    const double ratio = reynolds_per_length2(s.x) / reynolds_per_length2(s.reference);
    return force * pow(T(ratio), p[0]);
  }
};

}  // namespace

std::vector<Effect> reynolds_number() {
  const auto form = [](const char* name, std::vector<std::string> covariates) {
    return make_effect<ReynoldsNumber>({
        .name = "reynolds_number",
        .form = name,
        .formula = "F (Re / Re0)^m, Re = ρ Ω R c / μ(Θ)",
        .physics = "lift of thin blades grows with Re below 1e5 (Deters, Ananda & Selig, AIAA 2014-2151)",
        .parameters = {{"exponent", "1", -0.5, 0.8}},
        .covariates = std::move(covariates),
        .scope = EffectScope::kShared,
        .sign_rule = "both: some blades lose, most gain",
        .force_N = {},
        .jet_N = {},
    });
  };
  return {form("", {"speed_rpm", "air_temperature_C"}),
          form("measured pressure", {"speed_rpm", "air_temperature_C", "air_pressure_Pa"})};
}

}  // namespace tunnelrig::effects
