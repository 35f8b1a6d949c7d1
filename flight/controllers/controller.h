// What a position controller is given and what it gives. A controller is a struct with
//   ControlOutput step(const ControlInput&)   once per period of 1/400 s, without allocation
//   void reset()                              forgets what it has integrated
//   std::vector<NamedGain> gain_list()             its gains by name, with their limits
#pragma once

#include "flight/vehicle/airframe.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace tunnelrig {

/// y and z.
using Plane = std::array<double, 2>;

/// Where the vehicle ought to be, and the derivatives of that.
struct PlanarReference {
  Plane position_m{}, velocity_m_s{}, acceleration_m_s2{}, jerk_m_s3{};
};

struct ControlInput {
  PlanarReference reference;
  Plane position_m{}, velocity_m_s{};  // estimated
  Plane acceleration_m_s2{};           // measured: specific force in the world frame less gravity
  double sin_roll = 0;                 // −(y component) of the thrust's direction
  double cos_tilt = 1;                 // cos φ cos θ
  double step_s = 1.0 / 400;
};

struct ControlOutput {
  double thrust_m_s2 = kGravity_m_s2;  // u₁ of (3.5): thrust over mass
  double roll_rad = 0;                 // positive accelerates to the left
  double roll_moment_N_m = 0;          // fed forward past the attitude loop
};

struct NamedGain {
  std::string_view name;
  double* value = nullptr;
  double lowest = 0, highest = 0;  // for the optimiser and for files
};

/// Limits common to all controllers.
struct OutputLimits {
  double roll_rad = 0.4363;  // 25°
  double lowest_thrust_m_s2 = 0.3 * kGravity_m_s2, highest_thrust_m_s2 = 2 * kGravity_m_s2;
};

/// Thrust and roll that give this acceleration: (3.5) solved for u₁ and φ, as (6.29) and (6.30) do.
inline ControlOutput thrust_vector(const Plane& acceleration_m_s2, double cos_tilt,
                                   const OutputLimits& limits) {
  ControlOutput out;
  out.thrust_m_s2 = std::clamp((kGravity_m_s2 + acceleration_m_s2[1]) / std::max(cos_tilt, 0.5),
                               limits.lowest_thrust_m_s2, limits.highest_thrust_m_s2);
  out.roll_rad = std::asin(std::clamp(-acceleration_m_s2[0] / out.thrust_m_s2, -0.5, 0.5));
  out.roll_rad = std::clamp(out.roll_rad, -limits.roll_rad, limits.roll_rad);
  return out;
}

}  // namespace tunnelrig
