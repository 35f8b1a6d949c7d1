#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {

// Made up: a wave in a quantity that only this laboratory writes down.
Effect cable_wave(Random& random) {
  const double phase = random.uniform(0, 2 * std::numbers::pi);
  return {.name = "cable_wave",
          .in_library = false,
          .covariates = {"cable_slack_mm"},
          .change = [phase](const Place& at, double size) {
            return size * std::sin(2 * std::numbers::pi * at.conditions().cable_slack_mm / 13 + phase);
          }};
}

}  // namespace tunnelrig::attribution
