#include "flight/vehicle/attitude_loop.h"

namespace tunnelrig {

AttitudeLoop::AttitudeLoop(const Airframe& believed, const AttitudeGains& gains, double step_s)
    : gains_(gains),
      step_s_(step_s),
      mass_kg_(believed.mass_kg),
      full_moment_N_m_(kRotors * believed.rotor_offset_m() * gains.share_for_attitude *
                       believed.largest_thrust_N),
      largest_N_(believed.largest_thrust_N),
      smallest_N_(believed.smallest_thrust_N),
      offset_m_(believed.rotor_offset_m()) {
  const std::array<AxisGains, 3> all = {gains.roll, gains.pitch, gains.yaw};
  for (std::size_t i = 0; i < 3; ++i) {
    axes_[i].gains = all[i];
    axes_[i].target_share = low_pass_share(all[i].target_filter_Hz, step_s);
    axes_[i].derivative_share = low_pass_share(all[i].derivative_filter_Hz, step_s);
  }
}

double AttitudeLoop::Axis::shape(double wanted, double time_s, double step_s) {
  const double rate = square_root_law(wanted - target, 1 / time_s, gains.acceleration_limit_rad_s2);
  const double change = gains.acceleration_limit_rad_s2 * step_s;
  target_rate += std::clamp(rate - target_rate, -change, change);
  target += target_rate * step_s;
  return target_rate;
}

double AttitudeLoop::Axis::deflection(double angle, double rate, double step_s) {
  // Half the limit for what corrects, as AC_AttitudeControl::update_ang_vel_target_from_att_error does.
  const double wanted =
      square_root_law(target - angle, gains.angle_p, 0.5 * gains.acceleration_limit_rad_s2) + target_rate;
  rate_command += target_share * (wanted - rate_command);
  const double previous = error;
  error = rate_command - rate;
  if (primed) derivative += derivative_share * ((error - previous) / step_s - derivative);
  primed = true;
  integral =
      std::clamp(integral + gains.rate_i * error * step_s, -gains.integral_limit, gains.integral_limit);
  return gains.rate_p * error + integral + gains.rate_d * derivative + gains.rate_feed_forward * rate_command;
}

PerRotor AttitudeLoop::step(const AttitudeTarget& target, const AttitudeSense& sense) {
  const double limit = gains_.angle_limit_rad;
  const std::array<double, 3> wanted = {std::clamp(target.roll_rad, -limit, limit),
                                        std::clamp(target.pitch_rad, -limit, limit), 0};
  const std::array<double, 3> angle = {sense.angles.roll_rad, sense.angles.pitch_rad, sense.angles.yaw_rad};
  std::array<double, 3> moment;
  for (std::size_t i = 0; i < 3; ++i) {
    axes_[i].shape(wanted[i], gains_.input_time_s, step_s_);
    moment[i] =
        full_moment_N_m_ * std::clamp(axes_[i].deflection(angle[i], sense.rate_rad_s[i], step_s_), -1.0, 1.0);
  }
  moment[0] += target.roll_moment_N_m;
  // Yaw has little authority; what it asks for is cut to a tenth of the range first.
  const double per_roll = 0.25 * moment[0] / offset_m_, per_pitch = 0.25 * moment[1] / offset_m_;
  const double yaw_limit = 0.1 * largest_N_;
  const double deflection_yaw = moment[2] / full_moment_N_m_ * gains_.share_for_attitude * largest_N_;
  const double per_yaw = std::clamp(deflection_yaw, -yaw_limit, yaw_limit);

  PerRotor thrust;
  for (std::size_t i = 0; i < kRotors; ++i)
    thrust[i] = kRotorY[i] * per_roll - kRotorX[i] * per_pitch + kRotorSpin[i] * per_yaw;
  const auto [least, most] = std::minmax_element(thrust.begin(), thrust.end());
  const double highest = largest_N_ - *most, lowest = smallest_N_ - *least;
  const double mean = 0.25 * mass_kg_ * target.thrust_m_s2;
  const double common = lowest < highest ? std::clamp(mean, lowest, highest) : 0.5 * (lowest + highest);
  for (double& t : thrust) t += common;
  return thrust;
}

}  // namespace tunnelrig
