#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {
namespace {

constexpr double kShaft_Hz = kNominalSpeed_rpm / 60;

/// Mean of what a sine of `amplitude_V` loses above `room_V` from its middle.
double mean_loss_V(double amplitude_V, double room_V) {
  if (amplitude_V <= room_V) return 0;
  const double edge = room_V / amplitude_V;
  return amplitude_V / std::numbers::pi * (std::sqrt(1 - edge * edge) - edge * std::acos(edge));
}

}  // namespace

// Vibration at the shaft's frequency, strong in some runs, drives the signal into the converter's end; the
// mean falls by what is cut off.
Effect adc_clipping(Random& random) {
  return {.name = "adc_clipping",
          .covariates = {"clip_fraction"},
          .rotor = random.below(kRotors),
          .change =
              [](const Place& at, double volts) {
                const double level_V = kZero_V + kGain_V_N * at.baseline_N();
                return -mean_loss_V(volts * at.conditions().vibration, kFullScale_V - level_V) /
                       (kGain_V_N * at.baseline_N());
              },
          .amplitude_unit = "V",
          .waveform_V =
              [](const Place& at, double volts) {
                return volts * at.conditions().vibration *
                       std::sin(2 * std::numbers::pi * kShaft_Hz * at.time_in_run_s);
              },
          .clips = true};
}

}  // namespace tunnelrig::attribution
