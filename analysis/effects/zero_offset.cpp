// A cell whose zero was not taken off, or not well.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct ZeroOffset {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * s.newtons_per_volt;
  }
};

}  // namespace

std::vector<Effect> zero_offset() {
  return {make_effect<ZeroOffset>({
      .name = "zero_offset",
      .form = "",
      .formula = "F + g z",
      .physics = "tare that was not taken off: a constant error, and so a larger share of small forces",
      .parameters = {{"offset", "V", -2, 2}},
      .covariates = {},
      .scope = EffectScope::kRotor,
      .origin = EffectOrigin::kOffset,
      .additive = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
