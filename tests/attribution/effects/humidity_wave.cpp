#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {

// Made up: a wave in relative humidity, one and a half periods over what a laboratory sees.
Effect humidity_wave(Random& random) {
  const double phase = random.uniform(0, 2 * std::numbers::pi);
  return {.name = "humidity_wave",
          .in_library = false,
          .covariates = {"relative_humidity"},
          .change = [phase](const Place& at, double size) {
            return size * std::sin(2 * std::numbers::pi * at.conditions().relative_humidity / 0.35 + phase);
          }};
}

}  // namespace tunnelrig::attribution
