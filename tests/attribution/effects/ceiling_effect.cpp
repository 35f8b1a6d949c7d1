#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// A ceiling lowers the pressure above the discs: T (1 + a e^(-z / (b R))), distance z in radii.
Effect ceiling_effect(Random& random) {
  const double length_R = random.uniform(0.8, 1.6);
  return {.name = "ceiling_effect",
          .covariates = {"ceiling_distance_R"},
          .fixed = {{"length", "R", length_R}},
          .change = [length_R](const Place& at, double a) {
            return a * std::exp(-at.conditions().ceiling_distance_R / length_R);
          }};
}

}  // namespace tunnelrig::attribution
