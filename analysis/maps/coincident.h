// Where estimates belong: which location is OT, which coincide, and how those are merged.
#pragma once

#include "analysis/maps/map_input.h"
#include "datasets/locations.h"

#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// Estimates of one quantity at n places, with their n × n covariance.
struct Estimates {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
  std::vector<Eigen::MatrixXd> over_root_dof;  // of each source (Summary), n × n
};

/// One member of every location.
Eigen::VectorXd values_of(const std::vector<LocationEstimate>& locations, double LocationEstimate::*value);

/// A Σ Aᵀ of each.
std::vector<Eigen::MatrixXd> transformed(const std::vector<Eigen::MatrixXd>& covariances,
                                         const Eigen::MatrixXd& by);

/// The index of the location at (0, 0); the number of locations where there is none.
std::size_t index_of_origin(const std::vector<LocationEstimate>& locations);

/// The position of a location, and its image in the half ȳ ≥ 0.
TunnelPoint position(const LocationEstimate& location);
TunnelPoint folded_position(const LocationEstimate& location);

bool same_position(const TunnelPoint& a, const TunnelPoint& b);

/// Which of n points are the same.
struct Coincidence {
  std::vector<Eigen::Index> first;  // for each point the first one at its position, itself among them
  std::vector<Eigen::Index> kept;   // the first of every position, in order
};
Coincidence coincidence(const std::vector<TunnelPoint>& points);

/// Generalised least squares under the constraint that estimates of one position agree; one estimate is left
/// for each of `kept`. The covariance may be singular. Throws InputError with `what`, which says what
/// differs, where estimates of one position differ and the covariance leaves no room for it.
Estimates merge_coincident(const Estimates& estimates, const Coincidence& positions, const std::string& what);

}  // namespace tunnelrig
