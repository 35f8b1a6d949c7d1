#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// The ground holds the wake up: T (1 + a e^(-z / (b R))), in open space, height z in radii.
Effect ground_effect(Random& random) {
  const double length_R = random.uniform(0.8, 1.6);
  return {.name = "ground_effect",
          .covariates = {"ground_distance_R"},
          .fixed = {{"length", "R", length_R}},
          .change = [length_R](const Place& at, double a) {
            return a * std::exp(-at.conditions().ground_distance_R / length_R);
          }};
}

}  // namespace tunnelrig::attribution
