// Where estimates belong: which location is OT, which coincide, and how those are merged.
#pragma once

#include "analysis/maps/map_input.h"
#include "datasets/locations.h"

#include <optional>
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

/// A x with its covariance, for m × n shares A.
Estimates combined(const Estimates& estimates, const Eigen::MatrixXd& shares);

/// The shares that each of n estimates has in those of `kept`, by generalised least squares under the
/// constraint that estimates of one position agree. The covariance may be singular. Throws InputError with
/// `what`, which says what differs, where estimates of one position differ and the covariance leaves no room
/// for it.
Eigen::MatrixXd merging_shares(const Estimates& estimates, const Coincidence& positions,
                               const std::string& what);

/// What merging_shares combines; throws as that does.
Estimates merge_coincident(const Estimates& estimates, const Coincidence& positions, const std::string& what);

/// The generalised least-squares estimate of β where estimate i is β column_i beside what is common to its
/// position, from the differences within positions alone: shares of n estimates, whose errors are
/// uncorrelated with those that merging leaves. Nothing where no differences show β.
std::optional<Eigen::RowVectorXd> shares_of_differences(const Eigen::MatrixXd& covariance,
                                                        const Coincidence& positions,
                                                        const Eigen::VectorXd& column);

}  // namespace tunnelrig
