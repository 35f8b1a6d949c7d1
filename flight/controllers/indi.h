// Incremental nonlinear dynamic inversion of the translation (Smeur, de Croon and Chu 2018): the next thrust
// vector is the one that acts now plus the acceleration that is missing now. No model of any disturbance is
// needed.
#pragma once

#include "flight/controllers/controller.h"
#include "flight/vehicle/attitude_loop.h"

#include <vector>

namespace tunnelrig {

struct IndiGains {
  Plane position = {4, 6}, velocity = {3, 4};  // 1/s², 1/s
  double filter_Hz = 3;  // of the measured acceleration and, alike, of the thrust vector
  double lead_s = 0;     // as IbsGains::lead_s
  double motor_lag_s = 0.04;
  OutputLimits limits;
};

class Indi {
 public:
  explicit Indi(const IndiGains& gains) : gains_(gains) {}

  ControlOutput step(const ControlInput& in) {
    thrust_m_s2_ += in.step_s / (in.step_s + gains_.motor_lag_s) * (commanded_m_s2_ - thrust_m_s2_);
    const Plane acting = {-thrust_m_s2_ * in.sin_roll, thrust_m_s2_ * in.cos_tilt - kGravity_m_s2};
    const double share = low_pass_share(gains_.filter_Hz, in.step_s);
    Plane wanted;
    for (std::size_t i = 0; i < 2; ++i) {
      // Both through the same filter, so that only what the thrust does not explain remains.
      missing_[i] += share * (acting[i] - in.acceleration_m_s2[i] - missing_[i]);
      wanted[i] = in.reference.acceleration_m_s2[i] + gains_.lead_s * in.reference.jerk_m_s3[i] +
                  gains_.position[i] * (in.reference.position_m[i] - in.position_m[i]) +
                  gains_.velocity[i] * (in.reference.velocity_m_s[i] - in.velocity_m_s[i]) + missing_[i];
    }
    const ControlOutput out = thrust_vector(wanted, in.cos_tilt, gains_.limits);
    commanded_m_s2_ = out.thrust_m_s2;
    return out;
  }

  void reset() { *this = Indi(gains_); }
  std::vector<NamedGain> gain_list();

 private:
  IndiGains gains_;
  Plane missing_{};
  double commanded_m_s2_ = kGravity_m_s2, thrust_m_s2_ = kGravity_m_s2;
};

}  // namespace tunnelrig
