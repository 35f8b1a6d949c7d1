// In a tunnel the wake comes back to the rotors, and takes time to do so.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct WakeRecirculation {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::exp;
    return force * (1.0 + p[0] * (1.0 - exp(-(s.x[0] + s.time_s) / p[1])));
  }
};

}  // namespace

std::vector<Effect> wake_recirculation() {
  return {make_effect<WakeRecirculation>({
      .name = "wake_recirculation",
      .form = "",
      .formula = "F (1 + b (1 − e^(−t/τ))), t since motor start",
      .physics = "the tunnel flow builds up after the start (thesis, chapter 5)",
      .parameters = {{"amplitude", "1", -0.5, 0.5},
                     {"time_constant", "s", 0.5, 7200, ParameterRole::kShape, time_constants_s(), {}}},
      .covariates = {"time_since_motor_start_s"},
      .scope = EffectScope::kShared,
      .tunnel_only = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
