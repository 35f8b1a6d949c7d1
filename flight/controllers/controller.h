// The one signature of all position controllers: what is wanted and what is estimated in, thrust and roll
// out.
//
//     ControlOutput step(const ControlInput&);   // every step_s
//     void reset();                              // forgets integrals and filters
//     std::vector<NamedGain> gain_list();             // what tuning and gain files may move
#pragma once

#include "flight/vehicle/airframe.h"
#include "flight/vehicle/quick_angles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace tunnelrig {

using Plane = std::array<double, 2>;  // y to the right, z up, in the cross-section

struct PlanarReference {
  Plane position_m{}, velocity_m_s{}, acceleration_m_s2{}, jerk_m_s3{};
};

struct ControlInput {
  PlanarReference reference;
  Plane position_m{}, velocity_m_s{};
  Plane acceleration_m_s2{};          // measured by the inertial sensors, gravity taken off
  double sin_roll = 0, cos_tilt = 1;  // cos φ cos θ
  double step_s = 1.0 / 400;
};

struct ControlOutput {
  double thrust_m_s2 = kGravity_m_s2;  // u₁ of (3.5): over the mass
  double roll_rad = 0;
  double roll_moment_N_m = 0;  // past the attitude loop
};

struct OutputLimits {
  double lowest_thrust_m_s2 = 2, highest_thrust_m_s2 = 2 * kGravity_m_s2;
  double roll_rad = 0.4;
};

/// u₁ and φ that accelerate by `wanted`: (6.29) and (6.30), which solve (3.5).
inline ControlOutput thrust_vector(const Plane& wanted_m_s2, double cos_tilt, const OutputLimits& limits) {
  // The limits are set before the division by the tilt, so that two divisions need not wait for each other.
  const double cosine = std::max(cos_tilt, 0.5);
  const double upwards = std::clamp(kGravity_m_s2 + wanted_m_s2[1], cosine * limits.lowest_thrust_m_s2,
                                    cosine * limits.highest_thrust_m_s2);
  const double sine = std::clamp(-wanted_m_s2[0] * cosine / upwards, -0.9, 0.9);
  return {upwards / cosine, std::clamp(quick_asin(sine), -limits.roll_rad, limits.roll_rad), 0};
}

/// A gain by name, where it stands and what it may be.
struct NamedGain {
  std::string_view name;
  double* value;
  double lowest, highest;
};

}  // namespace tunnelrig
