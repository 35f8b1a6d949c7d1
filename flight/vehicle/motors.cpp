#include "flight/vehicle/motors.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

Motors::Motors(const Airframe& frame, double step_s)
    : per_speed2_(frame.thrust_per_speed2_N_s2()),
      lowest_N_(frame.smallest_thrust_N),
      highest_N_(frame.largest_thrust_N),
      offset_m_(frame.rotor_offset_m()),
      torque_over_thrust_m_(frame.torque_over_thrust_m),
      left_half_(std::exp(-0.5 * step_s / frame.motor_lag_s)),
      left_whole_(std::exp(-step_s / frame.motor_lag_s)) {}

void Motors::settle(double thrust_N) {
  speed_.fill(std::sqrt(std::clamp(thrust_N, lowest_N_, highest_N_) / per_speed2_));
  target_ = speed_;
}

bool Motors::command(const PerRotor& thrust_N) {
  bool cut = false;
  for (std::size_t i = 0; i < kRotors; ++i) {
    const double allowed_N = std::clamp(thrust_N[i], lowest_N_, highest_N_);
    cut = cut || allowed_N != thrust_N[i];
    target_[i] = std::sqrt(allowed_N / per_speed2_);
  }
  return cut;
}

StepLoads Motors::advance(const PerRotor& factor) {
  PerRotor middle, end;
  for (std::size_t i = 0; i < kRotors; ++i) {
    const double deviation = speed_[i] - target_[i];
    middle[i] = target_[i] + deviation * left_half_;
    end[i] = target_[i] + deviation * left_whole_;
  }
  const StepLoads step = {loads(speed_, factor), loads(middle, factor), loads(end, factor)};
  speed_ = end;
  return step;
}

RotorLoads Motors::loads(const PerRotor& speed, const PerRotor& factor) const {
  PerRotor thrust;
  for (std::size_t i = 0; i < kRotors; ++i) thrust[i] = per_speed2_ * speed[i] * speed[i] * factor[i];
  // Pairs first: mirrored rotors then give exactly mirrored moments.
  const double right = thrust[0] + thrust[3], left = thrust[1] + thrust[2];
  const double front = thrust[0] + thrust[2], rear = thrust[1] + thrust[3];
  const double clockwise = thrust[2] + thrust[3], counter_clockwise = thrust[0] + thrust[1];
  return {right + left,
          {offset_m_ * (right - left), offset_m_ * (front - rear),
           torque_over_thrust_m_ * (clockwise - counter_clockwise)}};
}

}  // namespace tunnelrig
