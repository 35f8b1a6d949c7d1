// Fills a flight's log.
#pragma once

#include "flight/simulation/flight.h"

namespace tunnelrig {

/// Predicts, from commands and estimates alone, what the inertial sensors ought to measure, and keeps the
/// difference.
class ResidualRecorder {
 public:
  ResidualRecorder(const FlightSetup& setup, FlightLog* log);

  void cycle(long cycle, const ControlInput& in, const ControlOutput& out, double roll_target_rad,
             const PerRotor& thrust_N, const RigidState& truth, const AttitudeSense& sense,
             double airspeed_m_s);

 private:
  void predict(const ControlInput& in, const PerRotor& thrust_N, const AttitudeSense& sense);

  const FlightSetup& setup_;
  FlightLog* log_;
  Motors motors_;          // believed
  ResidualRow predicted_;  // of the cycle that follows
  ResidualRow sum_;
  std::array<double, 2> earlier_rate_{};
  bool has_prediction_ = false;
  int in_sum_ = 0;
};

}  // namespace tunnelrig
