#include "analysis/maps/gaussian_process.h"

#include "analysis/maps/symmetric_kernel.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How much of the excess a point can have: none where the field is 0 by construction, at OT and, if it is
/// odd, on ȳ = 0; all of it at a distance from there that is still short against that between locations.
double excess_share(Parity parity, const TunnelPoint& point) {
  constexpr double kDistance = 0.1;
  const double from_known = parity == Parity::kOdd ? point.y_norm : std::hypot(point.y_norm, point.z_norm);
  return 1 - std::exp(-std::pow(from_known / kDistance, 2));
}

}  // namespace

Eigen::Array3d matern(const Hyperparameters& h, double dy, double dz) {
  const double qy = std::pow(dy / h.length_y, 2), qz = std::pow(dz / h.length_z, 2);
  const double r = std::sqrt(5 * (qy + qz));
  const double tail = h.amplitude_percent * h.amplitude_percent * std::exp(-r);
  const double slope = tail * (1 + r) * 5 / 3;  // ∂k/∂ln ℓ = slope · q
  return {tail * (1 + r + r * r / 3), slope * qy, slope * qz};
}

MatrixXd noise_covariance(const FieldData& data, const Hyperparameters& hyperparameters) {
  MatrixXd noise = data.covariance + std::pow(hyperparameters.excess_percent, 2) * data.excess;
  // So that exact measurements leave a matrix that can be inverted: 10⁻⁵ of the field.
  noise.diagonal().array() +=
      1e-10 * std::max(data.values.squaredNorm() / static_cast<double>(data.size()), 1e-6);
  return noise;
}

GaussianProcess::GaussianProcess(FieldData data, const Hyperparameters& hyperparameters)
    : data_(std::move(data)), hyperparameters_(hyperparameters) {
  MatrixXd observed = noise_covariance(data_, hyperparameters_);
  for (Index i = 0; i < data_.size(); ++i) {
    observed.col(i) += covariance_with_data(data_.points[static_cast<std::size_t>(i)]);
  }
  factor_.compute(observed);
  offset_column_ = column_of_offset(data_);
  offset_ = offset_weights(factor_, offset_column_);
  weights_ = factor_.solve(data_.values - offset_.weights.dot(data_.values) * offset_column_);
}

double GaussianProcess::covariance(const TunnelPoint& a, const TunnelPoint& b) const {
  const auto base = [this](double dy, double dz) { return matern(hyperparameters_, dy, dz)(0); };
  return anchored(base, data_.parity, a, b);
}

VectorXd GaussianProcess::covariance_with_data(const TunnelPoint& point) const {
  VectorXd result(data_.size());
  for (Index i = 0; i < data_.size(); ++i) {
    result(i) = covariance(point, data_.points[static_cast<std::size_t>(i)]);
  }
  return result;
}

FieldEstimate GaussianProcess::at(const TunnelPoint& point) const {
  require_inside(point);
  const VectorXd with_data = covariance_with_data(point);
  VectorXd weights = factor_.solve(with_data);  // of the values
  const double unexplained = covariance(point, point) - factor_.matrixL().solve(with_data).squaredNorm();
  // (2.42), with h = 0 at the point: what is predicted is the field without the offset.
  const double of_offset = weights.dot(offset_column_);
  weights -= of_offset * offset_.weights;
  const double excess = std::pow(hyperparameters_.excess_percent, 2) * excess_share(data_.parity, point);
  const double variance = std::max(0.0, unexplained) + of_offset * of_offset * offset_.variance + excess;
  const double dof = effective_dof(data_.over_root_dof, weights, variance);
  return {with_data.dot(weights_), std::sqrt(variance), dof};
}

std::optional<FieldEstimate> GaussianProcess::offset() const { return estimate_of(offset_, data_); }

std::vector<LeftOut> GaussianProcess::leave_one_out() const {
  // Rasmussen & Williams (2006), (5.12), with P in place of the inverse: the offset is estimated anew each
  // time (Dubrule 1983).
  const MatrixXd inverse =
      without_offset(factor_.solve(MatrixXd::Identity(data_.size(), data_.size())), offset_);
  std::vector<LeftOut> result;
  for (Index i = 0; i < data_.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (data_.parity == Parity::kOdd && data_.points[at].y_norm == 0) continue;
    result.push_back({.label = data_.labels[at],
                      .measured = data_.values(i),
                      .predicted = data_.values(i) - weights_(i) / inverse(i, i),
                      .standard_uncertainty = std::sqrt(1 / inverse(i, i))});
  }
  return result;
}

}  // namespace tunnelrig
