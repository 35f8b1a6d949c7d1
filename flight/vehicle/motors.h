// Four motors with propellers: commanded thrust to speed (first-order lag, limits) to thrust ∝ Ω².
#pragma once

#include "flight/vehicle/airframe.h"
#include "flight/vehicle/rigid_body.h"

#include <array>

namespace tunnelrig {

using PerRotor = std::array<double, kRotors>;

class Motors {
 public:
  /// `step_s` is the only step that advance() takes.
  Motors(const Airframe& frame, double step_s);

  /// Speeds at which every rotor gives this thrust in undisturbed air.
  void settle(double thrust_N);

  /// Sets the speeds to go for; thrusts outside the motors' range are cut. Returns whether any was.
  bool command(const PerRotor& thrust_N);

  /// Loads over the next step; `factor` is each rotor's thrust over that in undisturbed air at the same
  /// speed.
  StepLoads advance(const PerRotor& factor);

  const PerRotor& speed_rad_s() const { return speed_; }
  double thrust_per_speed2_N_s2() const { return per_speed2_; }

 private:
  RotorLoads loads(const PerRotor& speed, const PerRotor& factor) const;

  double per_speed2_, lowest_N_, highest_N_, offset_m_, torque_over_thrust_m_;
  double left_half_, left_whole_;  // of a deviation, after half a step and a whole one
  PerRotor speed_{}, target_{};
};

}  // namespace tunnelrig
