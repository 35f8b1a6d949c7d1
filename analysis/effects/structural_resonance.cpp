// The frame swings at a multiple of the shaft's speed.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct StructuralResonance {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * (s.newtons_per_volt * s.x[0]);
  }
};

}  // namespace

std::vector<Effect> structural_resonance() {
  return {make_effect<StructuralResonance>({
      .name = "structural_resonance",
      .form = "",
      .formula = "F + g r A_shaft",
      .physics =
          "a cell that swings reads its mean wrongly; A is the amplitude of shaft and blade-pass lines",
      .parameters = {{"coefficient", "1", -5, 5}},
      .covariates = {"vibration_amplitude_V"},
      .scope = EffectScope::kRotor,
      .additive = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
