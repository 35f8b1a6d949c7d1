#include "flight/vehicle/rigid_body.h"

#include "flight/vehicle/quick_angles.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

/// What the derivatives depend on, as plain numbers that stay in registers: the position is not among them.
struct Motion {
  double vx, vy, vz, qw, qx, qy, qz, wx, wy, wz;

  Motion plus(const Motion& d, double step) const {
    return {vx + step * d.vx, vy + step * d.vy, vz + step * d.vz, qw + step * d.qw, qx + step * d.qx,
            qy + step * d.qy, qz + step * d.qz, wx + step * d.wx, wy + step * d.wy, wz + step * d.wz};
  }
};

/// `across` is the drag over the velocity across the rotor axes. Inlined by order: the compiler's budget
/// depends on what else it compiles beside, and calls cost a flight a sixth of its speed.
[[gnu::always_inline]] inline Motion derivative(const Motion& s, const BodyConstants& b,
                                                const RotorLoads& loads, double wind_m_s, double across) {
  const double vx = s.vx - wind_m_s;
  const double ax = 2 * (s.qx * s.qz + s.qw * s.qy), ay = 2 * (s.qy * s.qz - s.qw * s.qx);
  const double az = 1 - 2 * (s.qx * s.qx + s.qy * s.qy);
  const double axial = loads.thrust_N - (b.drag_along - b.drag_across) * (vx * ax + s.vy * ay + s.vz * az);
  const auto& [ix, iy, iz] = b.inertia;
  return {
      (axial * ax - across * vx) * b.per_mass,  // (3.2)
      (axial * ay - across * s.vy) * b.per_mass,
      (axial * az - across * s.vz) * b.per_mass - b.gravity_m_s2,
      -0.5 * (s.qx * s.wx + s.qy * s.wy + s.qz * s.wz),
      0.5 * (s.qw * s.wx + s.qy * s.wz - s.qz * s.wy),
      0.5 * (s.qw * s.wy + s.qz * s.wx - s.qx * s.wz),
      0.5 * (s.qw * s.wz + s.qx * s.wy - s.qy * s.wx),
      (loads.moment_N_m[0] - b.rate_damping[0] * s.wx + (iy - iz) * s.wy * s.wz) * b.per_inertia[0],  // (3.3)
      (loads.moment_N_m[1] - b.rate_damping[1] * s.wy + (iz - ix) * s.wz * s.wx) * b.per_inertia[1],
      (loads.moment_N_m[2] - b.rate_damping[2] * s.wz + (ix - iy) * s.wx * s.wy) * b.per_inertia[2]};
}

}  // namespace

BodyConstants::BodyConstants(const Airframe& frame)
    : mass_kg(frame.mass_kg),
      per_mass(1 / frame.mass_kg),
      inertia(frame.inertia_kg_m2),
      per_inertia{1 / inertia[0], 1 / inertia[1], 1 / inertia[2]},
      rate_damping(frame.rate_damping_N_m_s),
      drag_across(frame.linear_drag_N_s_m[0]),
      drag_along(frame.linear_drag_N_s_m[1]),
      drag_quadratic(frame.quadratic_drag_N_s2_m2) {}

void rk4_step(RigidState& state, const BodyConstants& body, const StepLoads& loads, double wind_m_s,
              double step_s) {
  auto& [px, py, pz] = state.position_m;
  auto& [vx, vy, vz] = state.velocity_m_s;
  auto& [qw, qx, qy, qz] = state.attitude;
  auto& [wx, wy, wz] = state.rate_rad_s;
  const Motion s = {vx, vy, vz, qw, qx, qy, qz, wx, wy, wz};
  const double air_x = vx - wind_m_s;
  const double across = body.drag_across + body.drag_quadratic * std::sqrt(air_x * air_x + vy * vy + vz * vz);
  const Motion k1 = derivative(s, body, loads[0], wind_m_s, across);
  const Motion k2 = derivative(s.plus(k1, 0.5 * step_s), body, loads[1], wind_m_s, across);
  const Motion k3 = derivative(s.plus(k2, 0.5 * step_s), body, loads[1], wind_m_s, across);
  const Motion k4 = derivative(s.plus(k3, step_s), body, loads[2], wind_m_s, across);
  // The method's sums for the position, whose derivatives are the stages' velocities.
  const double third = step_s * step_s / 6;
  px += step_s * vx + third * (k1.vx + k2.vx + k3.vx);
  py += step_s * vy + third * (k1.vy + k2.vy + k3.vy);
  pz += step_s * vz + third * (k1.vz + k2.vz + k3.vz);
  const double sixth = step_s / 6;
  const Motion end = s.plus(k1, sixth).plus(k2, 2 * sixth).plus(k3, 2 * sixth).plus(k4, sixth);
  vx = end.vx;
  vy = end.vy;
  vz = end.vz;
  wx = end.wx;
  wy = end.wy;
  wz = end.wz;
  // One Newton step of 1/|q|: the method leaves |q| within 1e-12 of 1.
  const double norm = 1.5 - 0.5 * (end.qw * end.qw + end.qx * end.qx + end.qy * end.qy + end.qz * end.qz);
  qw = norm * end.qw;
  qx = norm * end.qx;
  qy = norm * end.qy;
  qz = norm * end.qz;
}

EulerAngles euler_angles(const std::array<double, 4>& q) {
  return {quick_atan2(2 * (q[0] * q[1] + q[2] * q[3]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])),
          quick_asin(std::clamp(2 * (q[0] * q[2] - q[3] * q[1]), -1.0, 1.0)),
          quick_atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]))};
}

std::array<double, 4> attitude_from(const EulerAngles& a) {
  const double cr = std::cos(a.roll_rad / 2), sr = std::sin(a.roll_rad / 2);
  const double cp = std::cos(a.pitch_rad / 2), sp = std::sin(a.pitch_rad / 2);
  const double cy = std::cos(a.yaw_rad / 2), sy = std::sin(a.yaw_rad / 2);
  return {cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
          cr * cp * sy - sr * sp * cy};
}

std::array<double, 9> rotation_matrix(const EulerAngles& a) {
  const double cr = std::cos(a.roll_rad), sr = std::sin(a.roll_rad);
  const double cp = std::cos(a.pitch_rad), sp = std::sin(a.pitch_rad);
  const double cy = std::cos(a.yaw_rad), sy = std::sin(a.yaw_rad);
  return {cp * cy,
          sr * sp * cy - cr * sy,
          cr * sp * cy + sr * sy,  //
          cp * sy,
          sr * sp * sy + cr * cy,
          cr * sp * sy - sr * cy,  //
          -sp,
          sr * cp,
          cr * cp};
}

double mechanical_energy_J(const RigidState& s, const Airframe& frame) {
  double energy = frame.mass_kg * kGravity_m_s2 * s.position_m[2];
  for (std::size_t i = 0; i < 3; ++i) {
    energy += 0.5 * frame.mass_kg * s.velocity_m_s[i] * s.velocity_m_s[i] +
              0.5 * frame.inertia_kg_m2[i] * s.rate_rad_s[i] * s.rate_rad_s[i];
  }
  return energy;
}

}  // namespace tunnelrig
