// The scatter that no model can predict.
#pragma once

#include "attribution/generator/settings.h"
#include "attribution/generator/world.h"

namespace tunnelrig::attribution {

/// Standard deviations, relative to thrust, of one rotor's reading.
struct NoiseModel {
  Noise kind = Noise::kWhite;
  double run = 0, session = 0;
  double persistence = 0;  // correlation of a run's scatter with that of the run before, within a session
  // Share of the variance that all rotors have in common; the rest is each rotor's own.
  double run_common = 0.5, session_common = 0.65;

  /// Scatter of a session's mean of `runs` runs.
  double of_session_mean(double runs) const;
};

NoiseModel draw_noise_model(const Settings& settings);

/// Relative scatter of every run and rotor.
std::vector<Rotors> draw_noise(const NoiseModel& model, const World& world, std::uint64_t seed);

/// What an exact mean model would leave on sessions that it has not seen, N.
struct NoiseFloor {
  double run_N = 0, session_N = 0, root_N = 0;
  double with_coefficients_N =
      0;  // and coefficients of locations estimated from three quarters of the sessions
};
NoiseFloor noise_floor(const NoiseModel& model, const World& world);

}  // namespace tunnelrig::attribution
