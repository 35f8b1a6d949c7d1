#include "analysis/maps/coincident.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSamePosition = 1e-6;  // a micrometre in the 1.5 m tunnel

/// C of C x = 0, a row for each estimate that is not the first at its position.
MatrixXd differences(const Coincidence& positions) {
  const auto n = static_cast<Index>(positions.first.size());
  MatrixXd c = MatrixXd::Zero(n - static_cast<Index>(positions.kept.size()), n);
  for (Index i = 0, row = 0; i < n; ++i) {
    const Index first = positions.first[static_cast<std::size_t>(i)];
    if (first == i) continue;
    c(row, i) = 1;
    c(row++, first) = -1;
  }
  return c;
}

MatrixXd pseudo_inverse(const MatrixXd& matrix) {
  return matrix.completeOrthogonalDecomposition().pseudoInverse();
}

}  // namespace

VectorXd values_of(const std::vector<LocationEstimate>& locations, double LocationEstimate::*value) {
  VectorXd values(static_cast<Index>(locations.size()));
  for (Index i = 0; i < values.size(); ++i) values(i) = locations[static_cast<std::size_t>(i)].*value;
  return values;
}

std::vector<MatrixXd> transformed(const std::vector<MatrixXd>& covariances, const MatrixXd& by) {
  std::vector<MatrixXd> result;
  for (const MatrixXd& covariance : covariances) result.emplace_back(by * covariance * by.transpose());
  return result;
}

std::size_t index_of_origin(const std::vector<LocationEstimate>& locations) {
  const auto at_origin = [](const auto& location) {
    return same_position(position(location), TunnelPoint{});
  };
  return static_cast<std::size_t>(std::find_if(locations.begin(), locations.end(), at_origin) -
                                  locations.begin());
}

TunnelPoint position(const LocationEstimate& location) { return {location.y_norm, location.z_norm}; }

TunnelPoint folded_position(const LocationEstimate& location) {
  const double y_norm = std::abs(location.y_norm);
  return {y_norm < kSamePosition ? 0 : y_norm, location.z_norm};
}

bool same_position(const TunnelPoint& a, const TunnelPoint& b) {
  return std::abs(a.y_norm - b.y_norm) < kSamePosition && std::abs(a.z_norm - b.z_norm) < kSamePosition;
}

Coincidence coincidence(const std::vector<TunnelPoint>& points) {
  Coincidence result;
  for (const TunnelPoint& point : points) {
    const auto is_here = [&](const TunnelPoint& other) { return same_position(point, other); };
    const Index first = std::find_if(points.begin(), points.end(), is_here) - points.begin();
    if (first == static_cast<Index>(result.first.size())) result.kept.push_back(first);
    result.first.push_back(first);
  }
  return result;
}

Estimates combined(const Estimates& estimates, const MatrixXd& shares) {
  const MatrixXd covariance = shares * estimates.covariance * shares.transpose();
  return {shares * estimates.values, 0.5 * (covariance + covariance.transpose()),
          transformed(estimates.over_root_dof, shares)};
}

MatrixXd merging_shares(const Estimates& estimates, const Coincidence& positions, const std::string& what) {
  // With the constraints C x = 0: x̂ = (I − G C) x, G = Σ Cᵀ (C Σ Cᵀ)⁺, which is the generalised
  // least-squares estimate and needs no inverse of Σ.
  const VectorXd& x = estimates.values;
  const MatrixXd c = differences(positions);
  MatrixXd shares = MatrixXd::Identity(x.size(), x.size());
  if (c.rows() == 0) return shares;
  shares -=
      estimates.covariance * c.transpose() * pseudo_inverse(c * estimates.covariance * c.transpose()) * c;
  if ((c * shares * x).cwiseAbs().maxCoeff() > 1e-6 * x.cwiseAbs().maxCoeff()) throw InputError(what);
  return shares(positions.kept, Eigen::all);
}

Estimates merge_coincident(const Estimates& estimates, const Coincidence& positions,
                           const std::string& what) {
  return combined(estimates, merging_shares(estimates, positions, what));
}

std::optional<Eigen::RowVectorXd> shares_of_differences(const MatrixXd& covariance,
                                                        const Coincidence& positions,
                                                        const VectorXd& column) {
  const MatrixXd c = differences(positions);
  if (c.rows() == 0) return {};
  // C x = β C h + C e, and the errors of x̂ have no part in C e: (I − G C) Σ Cᵀ = 0.
  const Eigen::RowVectorXd score =
      (c * column).transpose() * pseudo_inverse(c * covariance * c.transpose()) * c;
  const double information = score * column;
  if (!(information > 0)) return {};
  return score / information;
}

}  // namespace tunnelrig
