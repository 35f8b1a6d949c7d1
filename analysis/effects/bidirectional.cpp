// A cell pulls with another gain than it pushes.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct Bidirectional {
  template <class T>
  T operator()(const Sample&, const T* p, const T& force) const {
    return force < 0.0 ? force * (1.0 + p[0]) : force;
  }
};

}  // namespace

std::vector<Effect> bidirectional() {
  return {make_effect<Bidirectional>({
      .name = "bidirectional",
      .form = "",
      .formula = "F (1 + b) where F < 0",
      .physics = "play and asymmetry of the mounting",
      .parameters = {{"asymmetry", "1", -0.5, 0.5}},
      .covariates = {},
      .scope = EffectScope::kRotor,
      .origin = EffectOrigin::kCharacteristic,
      .needs_both_signs = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
