// A cell feels a neighbour's load.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct Crosstalk {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * s.other_N;
  }
};

}  // namespace

std::vector<Effect> crosstalk() {
  return {make_effect<Crosstalk>({
      .name = "crosstalk",
      .form = "",
      .formula = "F + x F_other",
      .physics = "the frame bends under the other rotor, or wires couple",
      .parameters = {{"coefficient", "1", -0.5, 0.5}},
      .covariates = {},
      .scope = EffectScope::kPair,
      .additive = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
