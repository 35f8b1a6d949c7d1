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
}

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

Estimates merge_coincident(const Estimates& estimates, const Coincidence& positions,
                           const std::string& what) {
  // With the constraints C x = 0: x̂ = x − G C x and Σ̂ = Σ − G C Σ, G = Σ Cᵀ (C Σ Cᵀ)⁺, which is the
  // generalised least-squares estimate and needs no inverse of Σ.
  const VectorXd& x = estimates.values;
  const MatrixXd& sigma = estimates.covariance;
  MatrixXd c = MatrixXd::Zero(x.size() - static_cast<Index>(positions.kept.size()), x.size());
  for (Index i = 0, row = 0; i < x.size(); ++i) {
    const Index first = positions.first[static_cast<std::size_t>(i)];
    if (first == i) continue;
    c(row, i) = 1;
    c(row++, first) = -1;
  }
  if (c.rows() == 0) return estimates;
  const MatrixXd of_differences = c * sigma * c.transpose();
  const MatrixXd gain =
      sigma * c.transpose() * of_differences.completeOrthogonalDecomposition().pseudoInverse();
  const VectorXd merged = x - gain * (c * x);
  if ((c * merged).cwiseAbs().maxCoeff() > 1e-6 * x.cwiseAbs().maxCoeff()) throw InputError(what);
  const MatrixXd covariance = sigma - gain * c * sigma;
  const MatrixXd kept = covariance(positions.kept, positions.kept);
  const MatrixXd shares = (MatrixXd::Identity(x.size(), x.size()) - gain * c)(positions.kept, Eigen::all);
  return {merged(positions.kept), 0.5 * (kept + kept.transpose()),
          transformed(estimates.over_root_dof, shares)};
}

}  // namespace tunnelrig
