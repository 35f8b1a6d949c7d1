#include "flight/controllers/pid.h"

namespace tunnelrig {
double AltitudeCascade::step(const ControlInput& in, double per_step_Hz) {
  const double to_go = in.reference.position_m[1] - in.position_m[1];
  const double velocity =
      std::clamp(square_root_law(to_go, gains_.position_p, gains_.acceleration_limit_m_s2) +
                     (feed_forward_ ? in.reference.velocity_m_s[1] : 0),
                 -gains_.sink_limit_m_s, gains_.climb_limit_m_s);
  velocity_error_ += low_pass_share(gains_.velocity_filter_Hz, in.step_s) *
                     (velocity - in.velocity_m_s[1] - velocity_error_);
  const double acceleration = std::clamp(
      gains_.velocity_p * velocity_error_ + (feed_forward_ ? in.reference.acceleration_m_s2[1] : 0),
      -gains_.acceleration_limit_m_s2, gains_.acceleration_limit_m_s2);
  const double previous = error_;
  error_ += low_pass_share(gains_.acceleration_filter_Hz, in.step_s) *
            (acceleration - in.acceleration_m_s2[1] - error_);
  // Errors count in cm/s², outputs in thousandths of the throttle.
  constexpr double kScale = 0.1;
  integral_ = std::clamp(integral_ + kScale * gains_.acceleration_i * error_ * in.step_s,
                         -gains_.integral_limit, gains_.integral_limit);
  const double throttle = kScale * gains_.acceleration_p * error_ + integral_ +
                          kScale * gains_.acceleration_d * (error_ - previous) * per_step_Hz;
  return (kGravity_m_s2 + full_thrust_m_s2_ * throttle) / std::max(in.cos_tilt, 0.5);
}

ControlOutput PidCascade::step(const ControlInput& in) {
  const double per_step_Hz = 1 / in.step_s;
  const double to_go = in.reference.position_m[0] - in.position_m[0];
  const double velocity =
      std::clamp(square_root_law(to_go, lateral_.position_p, 0.5 * lateral_.acceleration_limit_m_s2) +
                     (feed_forward_ ? in.reference.velocity_m_s[0] : 0),
                 -lateral_.speed_limit_m_s, lateral_.speed_limit_m_s);
  const double share = low_pass_share(lateral_.velocity_filter_Hz, in.step_s);
  const double previous = error_;
  error_ += share * (velocity - in.velocity_m_s[0] - error_);
  if (primed_) derivative_ += share * ((error_ - previous) * per_step_Hz - derivative_);
  primed_ = true;
  integral_ = std::clamp(integral_ + lateral_.velocity_i * error_ * in.step_s, -lateral_.integral_limit_m_s2,
                         lateral_.integral_limit_m_s2);
  const double acceleration =
      std::clamp(lateral_.velocity_p * error_ + integral_ + lateral_.velocity_d * derivative_ +
                     (feed_forward_ ? in.reference.acceleration_m_s2[0] : 0),
                 -lateral_.acceleration_limit_m_s2, lateral_.acceleration_limit_m_s2);
  return {
      std::clamp(altitude_.step(in, per_step_Hz), limits_.lowest_thrust_m_s2, limits_.highest_thrust_m_s2),
      std::clamp(-quick_atan(acceleration * (1 / kGravity_m_s2)), -limits_.roll_rad, limits_.roll_rad), 0};
}

void PidCascade::reset() {
  altitude_.reset();
  error_ = derivative_ = integral_ = 0;
  primed_ = false;
}

ControlOutput PidSingle::step(const ControlInput& in) {
  const double error = in.reference.position_m[0] - in.position_m[0];
  const double error_rate = in.reference.velocity_m_s[0] - in.velocity_m_s[0];
  integral_rad_ = std::clamp(integral_rad_ + lateral_.i * error * in.step_s, -lateral_.integral_limit_rad,
                             lateral_.integral_limit_rad);
  const double u_phi = lateral_.p * error + integral_rad_ + lateral_.d * error_rate;  // (6.16)
  // A positive roll accelerates to the left (3.5), so the angle has the sign of −u_φ.
  return {
      std::clamp(altitude_.step(in, 1 / in.step_s), limits_.lowest_thrust_m_s2, limits_.highest_thrust_m_s2),
      std::clamp(-u_phi, -limits_.roll_rad, limits_.roll_rad), 0};
}

void PidSingle::reset() {
  altitude_.reset();
  integral_rad_ = 0;
}

}  // namespace tunnelrig
