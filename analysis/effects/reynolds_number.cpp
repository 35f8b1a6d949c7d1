// Blades at low Reynolds number lose lift.
#include "analysis/air.h"
#include "analysis/effects/effect.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::effects {
namespace {

/// At 101325 Pa; viscosity by Sutherland.
double reynolds(std::span<const double> x, const Rig& rig) {
  const double kelvin = x[1] + kZeroCelsius_K;
  const double tip_m_s = x[0] * 2 * std::numbers::pi / 60 * rig.propeller_radius_m;
  return dry_air_density_kg_m3(101325.0, kelvin) * tip_m_s * rig.blade_chord_m / air_viscosity_Pa_s(kelvin);
}

struct ReynoldsNumber {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    const double ratio = reynolds(s.x, *s.rig) / reynolds(s.reference, *s.rig);
    return force * pow(T(ratio), p[0]);
  }
};

}  // namespace

std::vector<Effect> reynolds_number() {
  return {make_effect<ReynoldsNumber>({
      .name = "reynolds_number",
      .form = "",
      .formula = "F (Re / Re0)^m, Re = ρ Ω R c / μ(Θ)",
      .physics = "lift of thin blades grows with Re below 1e5 (Deters, Ananda & Selig, AIAA 2014-2151)",
      .parameters = {{"exponent", "1", -0.5, 0.8}},
      .covariates = {"speed_rpm", "air_temperature_C"},
      .scope = EffectScope::kShared,
      .sign_rule = "both: some blades lose, most gain",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
