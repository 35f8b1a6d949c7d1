#include "flight/localisation/kalman_filter.h"

#include "flight/vehicle/airframe.h"

namespace tunnelrig {
namespace {

using Square = Eigen::Matrix2d;

/// At rest at a position; what a filter knows besides is left to it.
template <int kStates>
Belief<kStates> kinematic_start(const Eigen::Vector2d& position_m, const StartSettings& start) {
  Belief<kStates> belief;
  belief.state.template head<2>() = position_m;
  belief.covariance.diagonal().template head<4>()
      << Eigen::Array2d::Constant(start.position_sigma_m).square(),
      Eigen::Array2d::Constant(start.velocity_sigma_m_s).square();
  return belief;
}

Belief<7> inertial_start(const Eigen::Vector2d& position_m, const StartSettings& start) {
  Belief<7> belief = kinematic_start<7>(position_m, start);
  belief.covariance.diagonal().tail<3>() << start.roll_sigma_rad * start.roll_sigma_rad,
      Eigen::Array2d::Constant(start.bias_sigma_m_s2).square();
  return belief;
}

Belief<8> augmented_start(const Eigen::Vector2d& position_m, const StartSettings& start) {
  Belief<8> belief = kinematic_start<8>(position_m, start);
  belief.covariance.diagonal().tail<4>() << Eigen::Array2d::Constant(start.disturbance_sigma_m_s2).square(),
      Eigen::Array2d::Constant(start.bias_sigma_m_s2).square();
  return belief;
}

}  // namespace

void KinematicModel::step(Belief<kStates>& belief, const Input& input, double dt_s, bool /*last*/) const {
  // (6.11), (6.12) with F = [[I, Δt I], [0, I]] and G = [½Δt² I; Δt I], block by block
  const double half = 0.5 * dt_s * dt_s;
  belief.state.head<2>() += dt_s * belief.state.tail<2>() + half * input.acceleration_m_s2;
  belief.state.tail<2>() += dt_s * input.acceleration_m_s2;

  const double variance = acceleration_variance_m2_s4 / (rate_hz * dt_s);  // of the mean over this step
  const Square pv = belief.covariance.topRightCorner<2, 2>();
  const Square vv = belief.covariance.bottomRightCorner<2, 2>();
  const Square unit = Square::Identity();
  belief.covariance.topLeftCorner<2, 2>() +=
      dt_s * (pv + pv.transpose()) + dt_s * dt_s * vv + half * half * variance * unit;
  const Square new_pv = pv + dt_s * vv + half * dt_s * variance * unit;
  belief.covariance.topRightCorner<2, 2>() = new_pv;
  belief.covariance.bottomLeftCorner<2, 2>() = new_pv.transpose();
  belief.covariance.bottomRightCorner<2, 2>() += dt_s * dt_s * variance * unit;
}

void InertialModel::step(Belief<kStates>& belief, const Input& input, double dt_s, bool /*last*/) const {
  auto& x = belief.state;
  auto& p = belief.covariance;
  const double half = 0.5 * dt_s * dt_s;
  // measured = a + b + e (−g − a_z, a_y), to first order in e
  const Eigen::Vector2d& measured = input.acceleration_m_s2;
  const Eigen::Vector2d per_roll(kGravity_m_s2 + measured.y(), -measured.x());
  const Eigen::Vector2d acceleration = measured + per_roll * x(kRollError) - x.tail<2>();
  x.head<2>() += dt_s * x.segment<2>(2) + half * acceleration;
  x.segment<2>(2) += dt_s * acceleration;

  // F P Fᵀ, F = I + Δt E(p,v) + ½Δt² E(p,a) + Δt E(v,a), a = per_roll e − b: rows, then columns
  const Eigen::Matrix<double, 2, kStates> rows = per_roll * p.row(kRollError) - p.bottomRows<2>();
  p.topRows<2>() += dt_s * p.middleRows<2>(2) + half * rows;
  p.middleRows<2>(2) += dt_s * rows;
  const Eigen::Matrix<double, kStates, 2> columns =
      p.col(kRollError) * per_roll.transpose() - p.rightCols<2>();
  p.leftCols<2>() += dt_s * p.middleCols<2>(2) + half * columns;
  p.middleCols<2>(2) += dt_s * columns;

  const double variance = acceleration_variance_m2_s4 / (rate_hz * dt_s);
  for (int axis = 0; axis < 2; ++axis) {
    const int v = axis + 2;
    p(axis, axis) += half * half * variance;
    p(axis, v) += half * dt_s * variance;
    p(v, axis) += half * dt_s * variance;
    p(v, v) += dt_s * dt_s * variance;
    p(axis + 5, axis + 5) += bias_density_m2_s5 * dt_s;
  }
  p(kRollError, kRollError) += roll_density_rad2_s * dt_s;
}

void AugmentedModel::step(Belief<kStates>& belief, const Input& input, double dt_s, bool last) const {
  auto& x = belief.state;
  auto& p = belief.covariance;
  const double half = 0.5 * dt_s * dt_s;
  const Eigen::Vector2d acceleration = input.modelled_m_s2 + x.segment<2>(4);
  x.head<2>() += dt_s * x.segment<2>(2) + half * acceleration;
  x.segment<2>(2) += dt_s * acceleration;

  // F P Fᵀ with F = I + Δt E(p,v) + ½Δt² E(p,d) + Δt E(v,d): rows, then columns, positions first
  p.topRows<2>() += dt_s * p.middleRows<2>(2) + half * p.middleRows<2>(4);
  p.middleRows<2>(2) += dt_s * p.middleRows<2>(4);
  p.leftCols<2>() += dt_s * p.middleCols<2>(2) + half * p.middleCols<2>(4);
  p.middleCols<2>(2) += dt_s * p.middleCols<2>(4);
  // Integrals of the two white noises: of the acceleration into (p, v), of d's walk into (p, v, d)
  const double t2 = dt_s * dt_s;
  const double s = acceleration_density_m2_s3;
  const double w = disturbance_density_m2_s5;
  const double pp = s * t2 * dt_s / 3 + w * t2 * t2 * dt_s / 20;
  const double pv = s * t2 / 2 + w * t2 * t2 / 8;
  const double pd = w * t2 * dt_s / 6;
  const double vv = s * dt_s + w * t2 * dt_s / 3;
  const double vd = w * t2 / 2;
  for (int axis = 0; axis < 2; ++axis) {
    const int v = axis + 2;
    const int d = axis + 4;
    p(axis, axis) += pp;
    p(v, v) += vv;
    p(d, d) += w * dt_s;
    p(axis + 6, axis + 6) += bias_density_m2_s5 * dt_s;
    p(axis, v) += pv;
    p(v, axis) += pv;
    p(axis, d) += pd;
    p(d, axis) += pd;
    p(v, d) += vd;
    p(d, v) += vd;
  }
  if (!last) return;

  for (int axis = 0; axis < 2; ++axis) {
    const int d = axis + 4;
    const int b = axis + 6;
    const Eigen::Matrix<double, kStates, 1> with_measured = p.col(d) + p.col(b);
    const double variance = with_measured(d) + with_measured(b) + accelerometer_variance_m2_s4;
    const Eigen::Matrix<double, kStates, 1> gain = with_measured / variance;
    x += gain * (input.measured_m_s2(axis) - input.modelled_m_s2(axis) - x(d) - x(b));
    p.noalias() -= variance * gain * gain.transpose();
  }
}

KalmanFilter::KalmanFilter(const Eigen::Vector2d& position_m, const KinematicModel& model,
                           const GateSettings& gate, const StartSettings& start)
    : DelayedFilter(model, kinematic_start<4>(position_m, start), gate) {}

InertialFilter::InertialFilter(const Eigen::Vector2d& position_m, const InertialModel& model,
                               const GateSettings& gate, const StartSettings& start)
    : DelayedFilter(model, inertial_start(position_m, start), gate) {}

AugmentedFilter::AugmentedFilter(const Eigen::Vector2d& position_m, const AugmentedModel& model,
                                 const GateSettings& gate, const StartSettings& start)
    : DelayedFilter(model, augmented_start(position_m, start), gate) {}

}  // namespace tunnelrig
