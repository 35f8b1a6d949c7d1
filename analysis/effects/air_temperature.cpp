// Warm air is thin. A campaign's baseline has the density at the air's temperature; a table's thrust has not.
#include "analysis/air.h"
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct AirTemperature {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    return force * pow(T((s.reference[0] + kZeroCelsius_K) / (s.x[0] + kZeroCelsius_K)), p[0]);
  }
};

}  // namespace

std::vector<Effect> air_temperature() {
  return {make_effect<AirTemperature>({
      .name = "air_temperature",
      .form = "",
      .formula = "F (Θ_air0 / Θ_air)^n",
      .physics = "density is inversely proportional to absolute temperature, n = 1 (ideal gas)",
      .parameters = {{"exponent", "1", 0, 3, ParameterRole::kAmplitude, {}, 1.0}},
      .covariates = {"air_temperature_C"},
      .scope = EffectScope::kShared,
      .origin = EffectOrigin::kAirTemperature,
      .sign_rule = "thrust falls with temperature",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
