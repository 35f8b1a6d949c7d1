// Amplifiers and adhesive wander after they are switched on.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct ZeroDriftTime {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * (s.newtons_per_volt * since_zero(s, 0, 0));
  }
};

}  // namespace

std::vector<Effect> zero_drift_time() {
  return {make_effect<ZeroDriftTime>({
      .name = "zero_drift_time",
      .form = "",
      .formula = "F + g z h, h since the first run of the session",
      .physics = "slow drift of the zero of bridge and amplifier",
      .parameters = {{"rate", "V/h", -0.2, 0.2}},
      .covariates = {"hours_in_session"},
      .scope = EffectScope::kRotor,
      .additive = true,
      .of_zero = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
