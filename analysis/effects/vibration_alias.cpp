// Vibration at a multiple of the shaft's speed folds down to a slow wave.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct VibrationAlias {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * (s.newtons_per_volt * s.x[0]);
  }
};

}  // namespace

std::vector<Effect> vibration_alias() {
  return {make_effect<VibrationAlias>({
      .name = "vibration_alias",
      .form = "",
      .formula = "F + g a A_alias",
      .physics =
          "lines above half the sampling rate appear below it; A is the amplitude of the aliased lines",
      .parameters = {{"coefficient", "1", -5, 5}},
      .covariates = {"alias_amplitude_V"},
      .scope = EffectScope::kRotor,
      .additive = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
