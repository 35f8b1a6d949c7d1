// Flow towards the rotor is throttled by the ceiling, which lowers the pressure above it.
#include "analysis/effects/effect.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig::effects {
namespace {

struct CeilingImage {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    const double half = 0.25 / std::max(s.x[0], kNearestImage_R);
    return force / (1.0 - p[0] * (half * half));
  }
};

struct CeilingExponential {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::exp;
    return force * (1.0 + p[0] * exp(-s.x[0] / p[1]));
  }
};

}  // namespace

std::vector<Effect> ceiling_effect() {
  return {
      make_effect<CeilingImage>({
          .name = "ceiling_effect",
          .form = "image",
          .formula = "F / (1 − a (R / 4z)²), z ≥ R/2",
          .physics = "image of the inflow in the ceiling (Sanchez-Cuevas et al. 2017)",
          .parameters = {{"strength", "1", 0, 3}},
          .covariates = {"ceiling_distance_R"},
          .scope = EffectScope::kShared,
          .sign_rule = "more thrust near the ceiling",
          .force_N = {},
          .jet_N = {},
      }),
      make_effect<CeilingExponential>({
          .name = "ceiling_effect",
          .form = "exponential",
          .formula = "F (1 + a e^(−z/(b R)))",
          .physics = "fitted exponential (Hsiao & Chirarattananon 2019 for its trend)",
          .parameters =
              {{"amplitude", "1", 0, 2},
               {"length", "R", 0.1, 10, ParameterRole::kShape, {0.25, 0.4, 0.6, 0.9, 1.3, 1.9, 2.8, 4}, {}}},
          .covariates = {"ceiling_distance_R"},
          .scope = EffectScope::kShared,
          .sign_rule = "more thrust near the ceiling",
          .force_N = {},
          .jet_N = {},
      })};
}

}  // namespace tunnelrig::effects
