// Amplitudes, so that an effect has the size that was asked for.
#pragma once

#include "attribution/effects/effect.h"
#include "attribution/generator/noise.h"

namespace tunnelrig::attribution {

/// Where most of an effect's variance lies, and with which scatter it is therefore compared.
enum class Level { kRun, kSession };

struct Sized {
  Effect effect;
  double amplitude = 0;
  Level level = Level::kRun;
  double rms = 0;           // relative change, location means taken out (coefficients absorb those)
  double rms_over_run = 0;  // over the run scatter of one rotor
  double rms_over_level = 0;
};

/// Finds the amplitude, or for known physics the factor by which the covariate's excursions grow or shrink,
/// which changes `world`. Where the covariate does not reach (humidity ends at 0 and 1, and at
/// a steady humidity vapour still follows the temperature), `noise` is scaled instead. `free_mean`: location
/// means are not taken out (the baseline of open space has one coefficient).
Sized give_size(Effect effect, const Settings& settings, World& world, NoiseModel& noise, bool free_mean);

/// Size of the effect as it stands.
void measure(Sized& sized, const World& world, const NoiseModel& noise, bool free_mean);

}  // namespace tunnelrig::attribution
