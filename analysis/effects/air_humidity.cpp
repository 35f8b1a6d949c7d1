// Water vapour is lighter than the air that it displaces.
#include "analysis/air.h"
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct AirHumidity {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    const double kelvin = s.x[1] + kZeroCelsius_K;
    const double ratio =
        moist_air_density_kg_m3(101325.0, kelvin, s.x[0]) / dry_air_density_kg_m3(101325.0, kelvin);
    return force * pow(T(ratio), p[0]);
  }
};

}  // namespace

std::vector<Effect> air_humidity() {
  return {make_effect<AirHumidity>({
      .name = "air_humidity",
      .form = "",
      .formula = "F (ρ_moist / ρ_dry)^n",
      .physics = "vapour displaces dry air of the same pressure, n = 1 (ideal gases; Buck 1981)",
      .parameters = {{"exponent", "1", 0, 4, ParameterRole::kAmplitude, {}, 1.0}},
      .covariates = {"relative_humidity", "air_temperature_C"},
      .scope = EffectScope::kShared,
      .origin = EffectOrigin::kAirHumidity,
      .sign_rule = "thrust falls with humidity",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
