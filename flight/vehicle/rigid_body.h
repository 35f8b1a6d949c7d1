// Six degrees of freedom: (3.2), (3.3) with the orthonormal R that (3.4) means, as a quaternion.
#pragma once

#include "flight/vehicle/airframe.h"

#include <array>

namespace tunnelrig {

/// Position and velocity in the world frame, attitude body to world (w, x, y, z), rates in the body frame.
struct RigidState {
  std::array<double, 3> position_m{};
  std::array<double, 3> velocity_m_s{};
  std::array<double, 4> attitude{1, 0, 0, 0};
  std::array<double, 3> rate_rad_s{};
};

/// What acts at one instant: the rotors' thrust along the body's z axis, and moments about the body's axes.
struct RotorLoads {
  double thrust_N = 0;
  std::array<double, 3> moment_N_m{};
};

/// The same, at the beginning, middle and end of a step.
using StepLoads = std::array<RotorLoads, 3>;

/// The parts of an airframe that the equations need, with their reciprocals.
struct BodyConstants {
  explicit BodyConstants(const Airframe& frame);

  double mass_kg, per_mass;
  std::array<double, 3> inertia, per_inertia, rate_damping;
  double drag_across, drag_along, drag_quadratic;
  double gravity_m_s2 = kGravity_m_s2;
};

/// One step of the classical Runge-Kutta method. `wind_m_s` moves along x; it and the size of the airspeed in
/// the quadratic drag are held over the step.
void rk4_step(RigidState& state, const BodyConstants& body, const StepLoads& loads, double wind_m_s,
              double step_s);

/// Third column of R: the direction of thrust in the world frame.
inline std::array<double, 3> thrust_axis(const std::array<double, 4>& q) {
  return {2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]),
          1 - 2 * (q[1] * q[1] + q[2] * q[2])};
}

struct EulerAngles {
  double roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
};

/// Roll, pitch and yaw of (3.4).
EulerAngles euler_angles(const std::array<double, 4>& attitude);
std::array<double, 4> attitude_from(const EulerAngles& angles);

/// R of (3.4) as it must read to be orthonormal: its second column's second and third entries are S_φS_θS_ψ +
/// C_φC_ψ and S_φC_θ. Row-major, body to world.
std::array<double, 9> rotation_matrix(const EulerAngles& angles);

/// Kinetic energy of translation and rotation plus m g z.
double mechanical_energy_J(const RigidState& state, const Airframe& frame);

}  // namespace tunnelrig
