// The density follows the barometer; the baseline holds it at 101325 Pa.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct AirPressure {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    return force * pow(T(s.x[0] / 101325.0), p[0]);
  }
};

}  // namespace

std::vector<Effect> air_pressure() {
  return {make_effect<AirPressure>({
      .name = "air_pressure",
      .form = "",
      .formula = "F (p / 101325 Pa)^n",
      .physics = "density is proportional to pressure, n = 1 (ideal gas)",
      .parameters = {{"exponent", "1", 0, 3, ParameterRole::kAmplitude, {}, 1.0}},
      .covariates = {"air_pressure_Pa"},
      .scope = EffectScope::kShared,
      .origin = EffectOrigin::kAirPressure,
      .sign_rule = "thrust grows with pressure",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
