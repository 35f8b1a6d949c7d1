#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {

// Made up: an arch over the hours of the day, highest in the early afternoon.
Effect time_of_day_arch(Random& random) {
  const double noon_h = random.uniform(13, 14);
  return {.name = "time_of_day_arch",
          .in_library = false,
          .covariates = {"time_of_day_h"},
          .fixed = {{"top", "h", noon_h}},
          .change =
              [noon_h](const Place& at, double size) {
                const double away = (at.conditions().time_of_day_h - noon_h) / 3;
                return -size * away * away;
              },
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
