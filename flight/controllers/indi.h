// Incremental nonlinear dynamic inversion of the position (Smeur, de Croon and Chu 2018): the thrust vector
// that acts, plus what the measured acceleration lacks. Needs no model of the disturbance and no integral.
#pragma once

#include "flight/controllers/controller.h"

#include <vector>

namespace tunnelrig {

struct IndiGains {
  Plane position = {4, 4}, velocity = {3, 3};
  double filter_Hz = 3;  // of measured acceleration and acting thrust alike
  double lead_s = 0;
  double motor_lag_s = 0.04;
  OutputLimits limits;
};

class Indi {
 public:
  explicit Indi(const IndiGains& gains) : gains_(gains) {}

  ControlOutput step(const ControlInput& in) {
    const double motor_share = in.step_s / (in.step_s + gains_.motor_lag_s);
    const double share = in.step_s / (in.step_s + 1 / (6.283185307179586 * gains_.filter_Hz));
    thrust_m_s2_ += motor_share * (commanded_m_s2_ - thrust_m_s2_);
    const Plane acting = {-thrust_m_s2_ * in.sin_roll, thrust_m_s2_ * in.cos_tilt - kGravity_m_s2};
    Plane wanted;
    for (std::size_t i = 0; i < 2; ++i) {
      acting_[i] += share * (acting[i] - acting_[i]);
      measured_[i] += share * (in.acceleration_m_s2[i] - measured_[i]);
      const double acceleration = in.reference.acceleration_m_s2[i] +
                                  gains_.lead_s * in.reference.jerk_m_s3[i] +
                                  gains_.position[i] * (in.reference.position_m[i] - in.position_m[i]) +
                                  gains_.velocity[i] * (in.reference.velocity_m_s[i] - in.velocity_m_s[i]);
      wanted[i] = acceleration + acting_[i] - measured_[i];
    }
    const ControlOutput out = thrust_vector(wanted, in.cos_tilt, gains_.limits);
    commanded_m_s2_ = out.thrust_m_s2;
    return out;
  }

  void reset() { *this = Indi(gains_); }
  std::vector<NamedGain> gain_list();

 private:
  IndiGains gains_;
  double commanded_m_s2_ = kGravity_m_s2, thrust_m_s2_ = kGravity_m_s2;
  Plane acting_{}, measured_{};
};

}  // namespace tunnelrig
