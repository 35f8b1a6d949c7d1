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
      : ibs_(IbsForm::kLyapunov, gains), context_(context) {}

  ControlOutput step(const ControlInput& in) {
    ControlOutput out = thrust_vector(ibs_.wanted_acceleration(in), in.cos_tilt, ibs_.limits());
    if (context_.map == nullptr) return out;
    // The motors need their lag to answer: the map is read where the vehicle will be then.
    const double y_m = in.position_m[0] + ahead_s_ * in.velocity_m_s[0];
    const double z_m = in.position_m[1] + ahead_s_ * in.velocity_m_s[1];
    const Disturbance d = context_.map->at(context_.scale.y_norm(y_m), context_.scale.z_norm(z_m));
    out.thrust_m_s2 /= 1 + d.thrust_change;
    out.roll_moment_N_m =
        -d.uneven * (1 + d.thrust_change) * context_.rotor_offset_m * context_.mass_kg * out.thrust_m_s2;
    return out;
  }

  void reset() { ibs_.reset(); }
  std::vector<NamedGain> gain_list();

 private:
  Ibs ibs_;
  ControllerContext context_;
  double ahead_s_ = 0.05;
};

}  // namespace tunnelrig
