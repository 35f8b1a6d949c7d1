// Integral backstepping in the Lyapunov form with the measured map fed forward: thrust is divided by what the
// walls add to it, and the rolling moment that they make is met before the vehicle rolls.
#pragma once

#include "flight/controllers/ibs.h"
#include "flight/vehicle/disturbance_field.h"
#include "flight/vehicle/section_scale.h"

namespace tunnelrig {

/// What a controller may know of vehicle and tunnel.
struct ControllerContext {
  double mass_kg = Airframe{}.mass_kg;
  double rotor_offset_m = Airframe{}.rotor_offset_m();
  double full_thrust_m_s2 =
      kRotors * Airframe{}.largest_thrust_N / Airframe{}.mass_kg;  // u₁ at full throttle
  const DisturbanceField* map = nullptr;                           // the measured one; not owned
  SectionScale scale;
};

class IbsMap {
 public:
  IbsMap(const IbsGains& gains, const ControllerContext& context)
      : ibs_(IbsForm::kLyapunov, gains),
        map_(context.map),
        centre_m_{context.scale.centre_y_m, context.scale.centre_z_m},
        per_half_span_{1 / context.scale.half_span_y_m, 1 / context.scale.half_span_z_m},
        moment_arm_kg_m_(context.rotor_offset_m * context.mass_kg) {}

  ControlOutput step(const ControlInput& in) {
    ControlOutput out = thrust_vector(ibs_.wanted_acceleration(in), in.cos_tilt, ibs_.limits());
    if (map_ == nullptr) return out;
    // The motors need their lag to answer: the map is read where the vehicle will be then.
    const auto ahead_norm = [&](std::size_t i) {
      return (in.position_m[i] + ahead_s_ * in.velocity_m_s[i] - centre_m_[i]) * per_half_span_[i];
    };
    const Disturbance d = map_->at(ahead_norm(0), ahead_norm(1));
    // The moment is that of the thrust divided by 1 + ΔC_T, times 1 + ΔC_T.
    out.roll_moment_N_m = -d.uneven * moment_arm_kg_m_ * out.thrust_m_s2;
    out.thrust_m_s2 /= 1 + d.thrust_change;
    return out;
  }

  void reset() { ibs_.reset(); }
  std::vector<NamedGain> gain_list();

 private:
  Ibs ibs_;
  const DisturbanceField* map_;
  Plane centre_m_, per_half_span_;  // of the section: ȳ and z̄ without a division
  double moment_arm_kg_m_;
  double ahead_s_ = 0.05;
};

}  // namespace tunnelrig
