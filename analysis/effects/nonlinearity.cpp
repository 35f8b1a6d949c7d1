// A cell's characteristic is a little curved.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct Nonlinearity {
  template <class T>
  T operator()(const Sample&, const T* p, const T& force) const {
    return force * (1.0 + p[0] * force);
  }
};

}  // namespace

std::vector<Effect> nonlinearity() {
  return {make_effect<Nonlinearity>({
      .name = "nonlinearity",
      .form = "",
      .formula = "F (1 + q F)",
      .physics = "second-order term of the cell's characteristic (OIML R 60, linearity)",
      .parameters = {{"coefficient", "1/N", -0.01, 0.01}},
      .covariates = {},
      .scope = EffectScope::kRotor,
      .origin = EffectOrigin::kCharacteristic,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
