#include "analysis/maps/map_input.h"

#include "analysis/maps/coincident.h"
#include "datasets/error.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kFewestLocations = 4;
// Locations that leave a line by less than this (4 mm in the 1.5 m tunnel) say nothing of what is beside it.
constexpr double kOnALine = 0.01;

void check_geometry(const MapInput& input) {
  const MapGeometry& g = input.geometry;
  for (const auto& [key, length_m] :
       {std::pair<const char*, double>{"rig.vehicle_width_m", g.vehicle_width_m},
        {"rig.vehicle_height_m", g.vehicle_height_m},
        {"tunnel.width_m", g.tunnel_width_m},
        {"tunnel.height_m", g.tunnel_height_m},
        {"rig.propeller_radius_m", g.propeller_radius_m}}) {
    if (std::isfinite(length_m) && length_m > 0) continue;
    throw InputError::in(input.source, "{} of campaign.toml is {}; a map needs it, above 0", key,
                         length_m == 0 ? "missing or 0" : fmt::format("{} m", length_m));
  }
  if (g.vehicle_width_m >= g.tunnel_width_m || g.vehicle_height_m >= g.tunnel_height_m) {
    throw InputError::in(input.source,
                         "a vehicle of {} m × {} m (tip to tip) does not fit a tunnel of {} m × {} m",
                         g.vehicle_width_m, g.vehicle_height_m, g.tunnel_width_m, g.tunnel_height_m);
  }
}

void check_location(const MapInput& input, const LocationEstimate& location) {
  if (!(std::abs(location.y_norm) <= 1) || !(std::abs(location.z_norm) <= 1)) {
    throw InputError::in(input.source,
                         "location {} is at ({}, {}); normalised coordinates are within -1 and 1",
                         location.label, location.y_norm, location.z_norm);
  }
  if (!std::isfinite(location.c_t) || location.c_t <= 0) {
    throw InputError::in(input.source, "location {} has C_T = {}; it must be above 0", location.label,
                         location.c_t);
  }
  if (!std::isfinite(location.u_percent)) {
    throw InputError::in(input.source, "location {} has U = {} %; it must be finite", location.label,
                         location.u_percent);
  }
  const auto first = std::find_if(input.locations.begin(), input.locations.end(), [&](const auto& other) {
    return canonical_location(other.label) == canonical_location(location.label);
  });
  if (!same_position(position(*first), position(location))) {
    throw InputError::in(input.source, "location {} stands at two positions, ({}, {}) and ({}, {})",
                         location.label, first->y_norm, first->z_norm, location.y_norm, location.z_norm);
  }
}

void check_covariance(const MapInput& input, const MatrixXd& covariance, const char* of) {
  const auto n = static_cast<Index>(input.locations.size());
  if (covariance.rows() != n || covariance.cols() != n) {
    throw InputError::in(input.source, "the covariance of {} is {} × {} for {} locations", of,
                         covariance.rows(), covariance.cols(), n);
  }
  if (!covariance.allFinite()) {
    throw InputError::in(input.source, "the covariance of {} holds a value that is not finite", of);
  }
  const double rounding = 1e-9 * covariance.cwiseAbs().maxCoeff();
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > rounding) {
    throw InputError::in(input.source, "the covariance of {} is not symmetric", of);
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(covariance, Eigen::EigenvaluesOnly);
  if (const double lowest = solver.eigenvalues()(0); lowest < -rounding) {
    throw InputError::in(
        input.source,
        "the covariance of {} is indefinite: a combination of locations has the variance {:.3g}", of, lowest);
  }
}

void check_origin(const MapInput& input) {
  if (index_of_origin(input.locations) < input.locations.size()) return;
  throw InputError::in(input.source, "no run at OT (y_norm = z_norm = 0); the map is the change against it");
}

/// Which further locations would make a map of those that vary least in the direction `across`.
const char* missing_locations(const Eigen::Vector2d& across) {
  if (std::abs(across.y()) < 0.1) return "at other positions across the tunnel (y_norm)";
  if (std::abs(across.x()) < 0.1) return "at other heights (z_norm)";
  return "beside that diagonal";
}

void check_spread(const MapInput& input) {
  std::vector<TunnelPoint> points;
  std::transform(input.locations.begin(), input.locations.end(), std::back_inserter(points), folded_position);
  const std::vector<Index> kept = coincidence(points).kept;
  if (kept.size() < kFewestLocations) {
    throw InputError::in(
        input.source, "{} location{} {} no map; at least {} are needed (mirror images count once)",
        kept.size(), kept.size() == 1 ? "" : "s", kept.size() == 1 ? "makes" : "make", kFewestLocations);
  }
  MatrixXd centred(static_cast<Index>(kept.size()), 2);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const TunnelPoint& point = points[static_cast<std::size_t>(kept[i])];
    centred.row(static_cast<Index>(i)) << point.y_norm, point.z_norm;
  }
  centred.rowwise() -= centred.colwise().mean().eval();
  const Eigen::JacobiSVD<MatrixXd> svd(centred, Eigen::ComputeThinV);
  const Eigen::Vector2d across = svd.matrixV().col(1);
  if ((centred * across).cwiseAbs().maxCoeff() > kOnALine) return;
  throw InputError::in(input.source, "all {} locations are on one line; measure {} as well", kept.size(),
                       missing_locations(across));
}

}  // namespace

MapInput merge_locations(const MapInput& input) {
  check_geometry(input);
  for (const LocationEstimate& location : input.locations) check_location(input, location);
  check_origin(input);
  check_spread(input);
  check_covariance(input, input.c_t_covariance, "C_T");
  check_covariance(input, input.u_covariance, "U");
  for (const MatrixXd& source : input.c_t_over_root_dof) check_covariance(input, source, "C_T by source");
  for (const MatrixXd& source : input.u_over_root_dof) check_covariance(input, source, "U by source");

  std::vector<TunnelPoint> points;
  std::transform(input.locations.begin(), input.locations.end(), std::back_inserter(points), position);
  const Coincidence positions = coincidence(points);
  const std::string differ = "at one position differ, and their covariance says that they cannot";
  const Estimates c_t = merge_coincident(
      {values_of(input.locations, &LocationEstimate::c_t), input.c_t_covariance, input.c_t_over_root_dof},
      positions, fmt::format("{}: estimates of C_T {}", input.source, differ));
  const Estimates u = merge_coincident(
      {values_of(input.locations, &LocationEstimate::u_percent), input.u_covariance, input.u_over_root_dof},
      positions, fmt::format("{}: estimates of U {}", input.source, differ));
  MapInput merged{.source = input.source,
                  .c_t_covariance = c_t.covariance,
                  .u_covariance = u.covariance,
                  .c_t_over_root_dof = c_t.over_root_dof,
                  .u_over_root_dof = u.over_root_dof,
                  .scatter_known = input.scatter_known,
                  .geometry = input.geometry,
                  .c_t_open_space = input.c_t_open_space};
  for (const Index i : positions.kept) {
    LocationEstimate location = input.locations[static_cast<std::size_t>(i)];
    const auto row = static_cast<Index>(merged.locations.size());
    location.label = canonical_location(location.label);
    location.c_t = c_t.values(row);
    location.u_percent = u.values(row);
    merged.locations.push_back(std::move(location));
  }
  return merged;
}

}  // namespace tunnelrig
