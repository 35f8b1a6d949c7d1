// Integral backstepping, (6.17) to (6.30).
#pragma once

#include "flight/controllers/controller.h"

#include <vector>

namespace tunnelrig {

struct IbsGains {
  Plane k1 = {0.6, 0.6}, k2 = {2.0, 2.0}, k3 = {2.0, 2.0};  // y, z
  double lead_s = 0;  // acceleration asked for so much ahead, to first order; 0 in the thesis
  double integral_limit_m_s2 = 2;
  OutputLimits limits;
};

/// a₁, a₂, a₃ of (6.29), or c₁, c₂, c₃ of (6.30).
struct IbsLaw {
  double proportional, derivative, integral;
};

enum class IbsForm {
  kPrinted,   // a₁ = k₁ + k₂k₃: V̇₂ keeps −e_p e_v
  kLyapunov,  // a₁ = 1 + k₁ + k₂k₃: V̇₂ = −k₂e_p² − k₃e_v²
};

inline IbsLaw ibs_law(IbsForm form, double k1, double k2, double k3) {
  return {(form == IbsForm::kLyapunov ? 1 : 0) + k1 + k2 * k3, k2 + k3, k1 * k3};
}

class Ibs {
 public:
  Ibs(IbsForm form, const IbsGains& gains) : gains_(gains), form_(form) {}

  ControlOutput step(const ControlInput& in) {
    return thrust_vector(wanted_acceleration(in), in.cos_tilt, gains_.limits);
  }

  /// ÿ_d + c₁e + c₂ė + c₃β and the same for z: what (6.29) and (6.30) have in their brackets beside g.
  Plane wanted_acceleration(const ControlInput& in) {
    Plane wanted;
    for (std::size_t i = 0; i < 2; ++i) {
      const IbsLaw law = ibs_law(form_, gains_.k1[i], gains_.k2[i], gains_.k3[i]);
      const double error = in.reference.position_m[i] - in.position_m[i];
      const double error_rate = in.reference.velocity_m_s[i] - in.velocity_m_s[i];
      beta_[i] += error * in.step_s;
      // Divided only where it is reached: divisions are most of what a step costs.
      if (std::abs(law.integral * beta_[i]) > gains_.integral_limit_m_s2)
        beta_[i] = std::copysign(gains_.integral_limit_m_s2 / law.integral, beta_[i]);
      wanted[i] = in.reference.acceleration_m_s2[i] + gains_.lead_s * in.reference.jerk_m_s3[i] +
                  law.proportional * error + law.derivative * error_rate + law.integral * beta_[i];
    }
    return wanted;
  }

  void reset() { beta_ = {}; }
  const Plane& beta() const { return beta_; }

  std::vector<NamedGain> gain_list();

  /// Also those of the lead, which the thesis's controller has not.
  std::vector<NamedGain> gain_list_with_lead();

  const OutputLimits& limits() const { return gains_.limits; }

 private:
  IbsGains gains_;
  IbsForm form_;
  Plane beta_{};  // β of (6.18)
};

}  // namespace tunnelrig
