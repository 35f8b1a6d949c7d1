#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {

// 50 Hz from the supply on a cell's line, in all runs of some sessions.
Effect mains_pickup(Random& random) {
  const std::size_t rotor = random.below(kRotors);
  return {.name = "mains_pickup",
          .covariates = {"spectrum"},
          .rotor = rotor,
          .amplitude_unit = "V",
          .waveform_V = [](const Place& at, double volts) {
            const double time_s = at.conditions().start_s + at.time_in_run_s;
            return volts * std::sin(2 * std::numbers::pi * 50 * std::fmod(time_s, 100));
          }};
}

}  // namespace tunnelrig::attribution
