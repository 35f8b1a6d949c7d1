// The attitude loop below all controllers, in the manner of ArduCopter 4 (AC_AttitudeControl, AC_PID,
// AP_MotorsMatrix): shaped target → square-root P with feed-forward of the shaped rate → rate PID → mixer.
#pragma once

#include "flight/vehicle/motors.h"
#include "flight/vehicle/rigid_body.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tunnelrig {

/// P law whose output stays below what `limit` (the second derivative) can stop: linear near 0, a square root
/// beyond (ArduCopter's sqrt_controller without its look-ahead).
inline double square_root_law(double error, double p, double limit) {
  const double linear = limit / (p * p);
  if (error > linear) return std::sqrt(2 * limit * (error - 0.5 * linear));
  if (error < -linear) return -std::sqrt(2 * limit * (-error - 0.5 * linear));
  return p * error;
}

/// Share of a step that a first-order low pass takes over.
inline double low_pass_share(double cut_off_Hz, double step_s) {
  const double x = 6.283185307179586 * cut_off_Hz * step_s;
  return x / (1 + x);
}

struct AxisGains {
  double angle_p = 4.5;  // ATC_ANG_*_P
  double rate_p = 0.09, rate_i = 0.09,
         rate_d = 0.0036;  // ATC_RAT_*; P below the default 0.135: these motors lag by 40 ms
  double rate_feed_forward = 0;
  double integral_limit = 0.5;  // of the full deflection
  double target_filter_Hz = 20, derivative_filter_Hz = 20;
  double acceleration_limit_rad_s2 = 19.2;  // ATC_ACCEL_*_MAX, 110000 cdeg/s²
};

struct AttitudeGains {
  AxisGains roll, pitch;
  AxisGains yaw = {.rate_p = 0.18,
                   .rate_i = 0.018,
                   .rate_d = 0,
                   .derivative_filter_Hz = 5,
                   .acceleration_limit_rad_s2 = 4.7};
  double input_time_s = 0.15;  // ATC_INPUT_TC
  double angle_limit_rad = 0.5236;
  double share_for_attitude = 0.5;  // of a rotor's thrust, that roll and pitch may add or take
};

/// What a position controller asks of it. Thrust is over the mass it is told, as u₁ in (3.5).
struct AttitudeTarget {
  double roll_rad = 0, pitch_rad = 0;
  double thrust_m_s2 = kGravity_m_s2;
  double roll_moment_N_m = 0;  // fed forward past the loop
};

/// What it measures.
struct AttitudeSense {
  EulerAngles angles;
  std::array<double, 3> rate_rad_s{};
};

class AttitudeLoop {
 public:
  AttitudeLoop(const Airframe& believed, const AttitudeGains& gains, double step_s);

  /// Thrust of every rotor to be commanded. Roll and pitch come before height where the range does not hold
  /// all of them, as in AP_MotorsMatrix.
  PerRotor step(const AttitudeTarget& target, const AttitudeSense& sense);

  /// The shaped roll that the loop follows.
  double roll_target_rad() const { return axes_[0].target; }
  double mass_kg() const { return mass_kg_; }

 private:
  struct Axis {
    AxisGains gains;
    double target_share = 0, derivative_share = 0;
    double target = 0, target_rate = 0, rate_command = 0, error = 0, derivative = 0, integral = 0;
    bool primed = false;

    double shape(double wanted, double time_s, double step_s);
    double deflection(double angle, double rate, double step_s);
  };

  AttitudeGains gains_;
  double step_s_, mass_kg_, full_moment_N_m_, largest_N_, smallest_N_, offset_m_;
  std::array<Axis, 3> axes_;
};

}  // namespace tunnelrig
