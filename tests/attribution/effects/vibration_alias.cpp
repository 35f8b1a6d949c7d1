#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {

// A vibration above half the sample rate: at 1333.3 Hz it shows folded down, and the filter does not stop it.
Effect vibration_alias(Random& random) {
  const double frequency_Hz = random.uniform(760, 1250);
  return {.name = "vibration_alias",
          .covariates = {"spectrum"},
          .fixed = {{"frequency", "Hz", frequency_Hz}},
          .amplitude_unit = "V",
          .waveform_V = [frequency_Hz](const Place& at, double volts) {
            return volts * std::sin(2 * std::numbers::pi * frequency_Hz * at.time_in_run_s);
          }};
}

}  // namespace tunnelrig::attribution
