// A cell reads differently on the way up and on the way down.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct Hysteresis {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    if (std::isnan(s.previous_N)) return force;
    const double previous = s.previous_N;
    return force * (1.0 + p[0] * (previous > force ? 1.0 : previous < force ? -1.0 : 0.0));
  }
};

}  // namespace

std::vector<Effect> hysteresis() {
  return {make_effect<Hysteresis>({
      .name = "hysteresis",
      .form = "",
      .formula = "F (1 + h sign(F_prev − F))",
      .physics = "friction within the spring; F_prev is the predicted force of the run before",
      .parameters = {{"coefficient", "1", -0.1, 0.1}},
      .covariates = {},
      .scope = EffectScope::kRotor,
      .needs_previous = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
