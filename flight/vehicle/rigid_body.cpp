#include "flight/vehicle/rigid_body.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

/// The state's thirteen numbers in its own order, so that the sums of the method are plain loops.
constexpr std::size_t kNumbers = 13;
using Vector = std::array<double, kNumbers>;

Vector pack(const RigidState& s) {
  Vector v{};
  std::copy(s.position_m.begin(), s.position_m.end(), v.begin());
  std::copy(s.velocity_m_s.begin(), s.velocity_m_s.end(), v.begin() + 3);
  std::copy(s.attitude.begin(), s.attitude.end(), v.begin() + 6);
  std::copy(s.rate_rad_s.begin(), s.rate_rad_s.end(), v.begin() + 10);
  return v;
}

RigidState unpack(const Vector& v) {
  RigidState s;
  std::copy_n(v.begin(), 3, s.position_m.begin());
  std::copy_n(v.begin() + 3, 3, s.velocity_m_s.begin());
  std::copy_n(v.begin() + 6, 4, s.attitude.begin());
  std::copy_n(v.begin() + 10, 3, s.rate_rad_s.begin());
  return s;
}

[[gnu::always_inline]] inline void derive(const Vector& s, const BodyConstants& b, const RotorLoads& loads,
                                          double wind_m_s, Vector& d) {
  const double vx = s[3] - wind_m_s, vy = s[4], vz = s[5];
  const double qw = s[6], qx = s[7], qy = s[8], qz = s[9];
  const double wx = s[10], wy = s[11], wz = s[12];
  const double ax = 2 * (qx * qz + qw * qy), ay = 2 * (qy * qz - qw * qx), az = 1 - 2 * (qx * qx + qy * qy);
  const double across = b.drag_across + b.drag_quadratic * std::sqrt(vx * vx + vy * vy + vz * vz);
  const double axial = loads.thrust_N - (b.drag_along - b.drag_across) * (vx * ax + vy * ay + vz * az);
  d[0] = s[3];
  d[1] = s[4];
  d[2] = s[5];
  d[3] = (axial * ax - across * vx) * b.per_mass;  // (3.2)
  d[4] = (axial * ay - across * vy) * b.per_mass;
  d[5] = (axial * az - across * vz) * b.per_mass - b.gravity_m_s2;
  d[6] = -0.5 * (qx * wx + qy * wy + qz * wz);
  d[7] = 0.5 * (qw * wx + qy * wz - qz * wy);
  d[8] = 0.5 * (qw * wy + qz * wx - qx * wz);
  d[9] = 0.5 * (qw * wz + qx * wy - qy * wx);
  d[10] = (loads.moment_N_m[0] - b.rate_damping[0] * wx + (b.inertia[1] - b.inertia[2]) * wy * wz) *
          b.per_inertia[0];
  d[11] = (loads.moment_N_m[1] - b.rate_damping[1] * wy + (b.inertia[2] - b.inertia[0]) * wz * wx) *
          b.per_inertia[1];
  d[12] = (loads.moment_N_m[2] - b.rate_damping[2] * wz + (b.inertia[0] - b.inertia[1]) * wx * wy) *
          b.per_inertia[2];
}

[[gnu::always_inline]] inline Vector along(const Vector& s, const Vector& d, double step) {
  Vector r;
  for (std::size_t i = 0; i < kNumbers; ++i) r[i] = s[i] + step * d[i];
  return r;
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

// Wider registers where there are some; no fused products, so that all machines give the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
__attribute__((target_clones("avx2", "default")))
#endif
void rk4_step(RigidState& state, const BodyConstants& body, const StepLoads& loads, double wind_m_s,
              double step_s) {
  const Vector s = pack(state);
  Vector k1, k2, k3, k4, end;
  derive(s, body, loads[0], wind_m_s, k1);
  derive(along(s, k1, 0.5 * step_s), body, loads[1], wind_m_s, k2);
  derive(along(s, k2, 0.5 * step_s), body, loads[1], wind_m_s, k3);
  derive(along(s, k3, step_s), body, loads[2], wind_m_s, k4);
  const double sixth = step_s / 6;
  for (std::size_t i = 0; i < kNumbers; ++i) end[i] = s[i] + sixth * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
  // One Newton step of 1/|q|: the method leaves |q| within 1e-12 of 1.
  const double correction =
      1.5 - 0.5 * (end[6] * end[6] + end[7] * end[7] + end[8] * end[8] + end[9] * end[9]);
  for (std::size_t i = 6; i < 10; ++i) end[i] *= correction;
  state = unpack(end);
}

EulerAngles euler_angles(const std::array<double, 4>& q) {
  return {std::atan2(2 * (q[0] * q[1] + q[2] * q[3]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])),
          std::asin(std::clamp(2 * (q[0] * q[2] - q[3] * q[1]), -1.0, 1.0)),
          std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]))};
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
