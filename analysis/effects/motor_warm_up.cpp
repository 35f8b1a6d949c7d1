// Windings and magnets warm up after the start, and thrust settles.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct MotorWarmUp {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::exp;
    return force * (1.0 + p[0] * exp(-(s.x[0] + s.time_s) / p[1]));
  }
};

}  // namespace

std::vector<Effect> motor_warm_up() {
  return {make_effect<MotorWarmUp>({
      .name = "motor_warm_up",
      .form = "",
      .formula = "F (1 + a e^(−t/τ)), t since motor start",
      .physics = "winding resistance rises, magnets weaken: more thrust at first",
      .parameters = {{"amplitude", "1", 0, 0.5},
                     {"time_constant", "s", 0.5, 7200, ParameterRole::kShape, time_constants_s(), {}}},
      .covariates = {"time_since_motor_start_s"},
      .scope = EffectScope::kRotor,
      .origin = EffectOrigin::kMotor,
      .sign_rule = "thrust falls towards its settled value",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
