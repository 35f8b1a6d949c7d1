// The wake is held up by the ground.
#include "analysis/effects/effect.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig::effects {
namespace {

struct CheesemanBennett {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    const double half = 0.25 / std::max(s.x[0], kNearestImage_R);
    return force / (1.0 - p[0] * (half * half));
  }
};

struct GroundExponential {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::exp;
    return force * (1.0 + p[0] * exp(-s.x[0] / p[1]));
  }
};

}  // namespace

std::vector<Effect> ground_effect() {
  return {
      make_effect<CheesemanBennett>({
          .name = "ground_effect",
          .form = "image",
          .formula = "F / (1 − a (R / 4z)²), z ≥ R/2",
          .physics = "image of the wake in the ground: a = 1 for one rotor (Cheeseman & Bennett 1955), "
                     "larger for several (Sanchez-Cuevas et al. 2017)",
          .parameters = {{"strength", "1", 0, 3, ParameterRole::kAmplitude, {}, 1.0}},
          .covariates = {"ground_distance_R"},
          .scope = EffectScope::kShared,
          .sign_rule = "more thrust near the ground",
          .force_N = {},
          .jet_N = {},
      }),
      make_effect<GroundExponential>({
          .name = "ground_effect",
          .form = "exponential",
          .formula = "F (1 + a e^(−z/(b R)))",
          .physics = "fitted exponential; rotors side by side may lose thrust (He & Leang 2020)",
          .parameters =
              {{"amplitude", "1", -0.6, 2},
               {"length", "R", 0.1, 10, ParameterRole::kShape, {0.25, 0.4, 0.6, 0.9, 1.3, 1.9, 2.8, 4}, {}}},
          .covariates = {"ground_distance_R"},
          .scope = EffectScope::kShared,
          .sign_rule = "either",
          .force_N = {},
          .jet_N = {},
      })};
}

}  // namespace tunnelrig::effects
