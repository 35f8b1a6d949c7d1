// A wall beside the rotor feeds its tip vortex back.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct WallEffect {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::exp;
    return force * (1.0 + p[0] * exp(-s.x[0] / p[1]));
  }
};

}  // namespace

std::vector<Effect> wall_effect() {
  return {make_effect<WallEffect>({
      .name = "wall_effect",
      .form = "",
      .formula = "F (1 + a e^(−d/(b R)))",
      .physics = "a rotor loses or gains a little beside a wall (thesis, section 5.4)",
      .parameters = {{"amplitude", "1", -0.6, 0.6},
                     {"length", "R", 0.1, 10, ParameterRole::kShape, {0.25, 0.5, 1, 2, 4}, {}}},
      .covariates = {"wall_distance_R"},
      .scope = EffectScope::kRotor,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
