#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {

// Vibration drives the signal into the converter's end; the mean falls by what is cut off.
Effect adc_clipping(Random& random) {
  const std::size_t rotor = random.below(kRotors);
  return {.name = "adc_clipping",
          .covariates = {"clip_fraction"},
          .rotor = rotor,
          .amplitude_unit = "V",
          .waveform_V = [](const Place& at, double volts) {
            // strong in some runs, weak in others, as vibration is; the run decides
            const double strength = at.conditions().vibration_V;
            return volts * strength * std::sin(2 * std::numbers::pi * 83.3 * at.time_in_run_s);
          }};
}

}  // namespace tunnelrig::attribution
