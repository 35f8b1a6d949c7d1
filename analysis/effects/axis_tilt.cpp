// A tilted cell sees a part of the thrust.
#include "analysis/effects/effect.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::effects {
namespace {

struct AxisTilt {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    return force * pow(T(std::cos(s.x[0] * std::numbers::pi / 180)), p[0]);
  }
};

}  // namespace

std::vector<Effect> axis_tilt() {
  return {make_effect<AxisTilt>({
      .name = "axis_tilt",
      .form = "",
      .formula = "F (cos tilt)^n",
      .physics = "projection of the thrust on the cell's axis, n = 1",
      .parameters = {{"exponent", "1", 0, 3, ParameterRole::kAmplitude, {}, 1.0}},
      .covariates = {"tilt_deg"},
      .scope = EffectScope::kShared,
      .sign_rule = "reading falls with tilt",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
