// What a map is made of: the estimates at the measured locations, with what they share.
#pragma once

#include "analysis/maps/disturbance_map.h"

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// The estimate at one tunnel location.
struct LocationEstimate {
  std::string label;
  double y_norm = 0, z_norm = 0;  // −1 to 1 (4.1, 4.2); either half of the tunnel
  double c_t = 0;
  double u_percent = 0;  // (5.1)
};

/// Row and column i of a covariance belong to locations[i]. Locations share calibration, so that neither
/// matrix is diagonal.
struct MapInput {
  std::string source = "map";  // how messages name the campaign
  std::vector<LocationEstimate> locations;
  Eigen::MatrixXd c_t_covariance;  // n × n
  Eigen::MatrixXd u_covariance;    // n × n, square percentage points
  /// Summary's of the same name, each n × n; none where the covariances are known exactly.
  std::vector<Eigen::MatrixXd> c_t_over_root_dof, u_over_root_dof;
  /// Whether anything says how far C_T and U scatter; else the covariances are without it and bound nothing.
  bool scatter_known = true;
  MapGeometry geometry;
  std::optional<double> c_t_open_space;
};

/// Checks the input and merges estimates of one position (`OT` and `H0V0`, say) by generalised least squares.
/// Throws InputError, in plain words, for: a vehicle that does not fit its tunnel; a location outside
/// [−1, 1]² or not finite; C_T not above 0; one label at two positions; a covariance of the wrong shape, not
/// finite, not symmetric, or indefinite; no location at OT; fewer than 4 locations that differ, mirror images
/// counted once; all locations on one line; two estimates of one position that differ although the covariance
/// says that they cannot.
MapInput merge_locations(const MapInput& input);

}  // namespace tunnelrig
