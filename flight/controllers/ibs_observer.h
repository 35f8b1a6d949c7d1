// Backstepping in the Lyapunov form whose integral is replaced by an observer of the disturbing acceleration
// (Chen et al. 2016, "Disturbance-observer-based control and related methods"): v̇ = u + d, ṗ = −L(u + p +
// Lv), d̂ = p + Lv.
#pragma once

#include "flight/controllers/ibs.h"

namespace tunnelrig {

struct IbsObserverGains {
  Plane k2 = {2.0, 2.0}, k3 = {2.0, 2.0};
  Plane bandwidth_rad_s = {4, 4};  // L
  double lead_s = 0;
  double motor_lag_s = 0.04;  // between commanded and acting thrust
  double disturbance_limit_m_s2 = 3;
  OutputLimits limits;
};

class IbsObserver {
 public:
  explicit IbsObserver(const IbsObserverGains& gains) : gains_(gains) {}

  ControlOutput step(const ControlInput& in) {
    if (!primed_) {
      for (std::size_t i = 0; i < 2; ++i) p_[i] = -gains_.bandwidth_rad_s[i] * in.velocity_m_s[i];
      primed_ = true;
    }
    const double share = in.step_s / (in.step_s + gains_.motor_lag_s);
    thrust_m_s2_ += share * (commanded_m_s2_ - thrust_m_s2_);
    const Plane nominal = {-thrust_m_s2_ * in.sin_roll, thrust_m_s2_ * in.cos_tilt - kGravity_m_s2};
    Plane wanted;
    for (std::size_t i = 0; i < 2; ++i) {
      const double l = gains_.bandwidth_rad_s[i];
      const double d = p_[i] + l * in.velocity_m_s[i];
      p_[i] -= in.step_s * l * (nominal[i] + d);
      const IbsLaw law = ibs_law(IbsForm::kLyapunov, 0, gains_.k2[i], gains_.k3[i]);
      wanted[i] = in.reference.acceleration_m_s2[i] + gains_.lead_s * in.reference.jerk_m_s3[i] +
                  law.proportional * (in.reference.position_m[i] - in.position_m[i]) +
                  law.derivative * (in.reference.velocity_m_s[i] - in.velocity_m_s[i]) -
                  std::clamp(d, -gains_.disturbance_limit_m_s2, gains_.disturbance_limit_m_s2);
    }
    const ControlOutput out = thrust_vector(wanted, in.cos_tilt, gains_.limits);
    commanded_m_s2_ = out.thrust_m_s2;
    return out;
  }

  /// d̂, in y and z.
  Plane disturbance_m_s2(const Plane& velocity_m_s) const {
    return {p_[0] + gains_.bandwidth_rad_s[0] * velocity_m_s[0],
            p_[1] + gains_.bandwidth_rad_s[1] * velocity_m_s[1]};
  }

  void reset() { *this = IbsObserver(gains_); }
  std::vector<NamedGain> gain_list();

 private:
  IbsObserverGains gains_;
  Plane p_{};
  double commanded_m_s2_ = kGravity_m_s2, thrust_m_s2_ = kGravity_m_s2;
  bool primed_ = false;
};

}  // namespace tunnelrig
