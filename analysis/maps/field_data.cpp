#include "analysis/maps/field_data.h"

#include "analysis/maps/coincident.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// ΔC_T at every location, OT included, where row and column of the covariance are exactly 0.
struct ThrustChange {
  Estimates estimates;  // per cent
  MatrixXd excess;
};

ThrustChange thrust_change(const MapInput& merged) {
  const auto origin = static_cast<Index>(index_of_origin(merged.locations));
  const VectorXd c_t = values_of(merged.locations, &LocationEstimate::c_t);
  const VectorXd ratio = c_t / c_t(origin);
  // ∂(C_T,i / C_T0) = (∂C_T,i − ratio_i ∂C_T0) / C_T0
  MatrixXd jacobian = MatrixXd::Identity(c_t.size(), c_t.size());
  jacobian.col(origin) -= ratio;
  const double scale = 100 / c_t(origin);
  return {{(ratio.array() - 1) * 100, scale * scale * jacobian * merged.c_t_covariance * jacobian.transpose(),
           transformed(merged.c_t_over_root_dof, scale * jacobian)},
          jacobian * jacobian.transpose()};
}

/// Shares of all locations in the observations: those that merging the images leaves, and what the
/// differences between images say of an offset.
struct Folding {
  MatrixXd shares;
  bool with_differences = false;
};

Folding folding(const Estimates& mirrored, const Coincidence& positions, Parity parity, const VectorXd& sign,
                const std::string& source) {
  Folding result{merging_shares(
      mirrored, positions,
      fmt::format("{}: mirror images differ, and their covariance says that they cannot", source))};
  if (parity == Parity::kEven) return result;
  const auto of_offset = shares_of_differences(mirrored.covariance, positions, sign);
  if (!of_offset) return result;
  result.with_differences = true;
  result.shares.conservativeResize(result.shares.rows() + 1, Eigen::NoChange);
  result.shares.bottomRows(1) = *of_offset;
  return result;
}

/// Of merged images the field's excess counts once, as structure that both have; in their differences it can
/// only be an error, of each alone.
MatrixXd folded_excess(const MatrixXd& excess, const Coincidence& positions, const Folding& folding) {
  const auto n = static_cast<Index>(positions.kept.size());
  MatrixXd result = MatrixXd::Zero(folding.shares.rows(), folding.shares.rows());
  result.topLeftCorner(n, n) = excess(positions.kept, positions.kept);
  if (folding.with_differences) {
    const Eigen::RowVectorXd shares = folding.shares.row(n);
    result(n, n) = shares * excess * shares.transpose();
  }
  return result;
}

FieldData folded(const MapInput& merged, Parity parity, const Estimates& estimates, const MatrixXd& excess) {
  FieldData data{.parity = parity, .scatter_known = merged.scatter_known};
  VectorXd sign = VectorXd::Ones(estimates.values.size());
  std::vector<TunnelPoint> points;
  for (Index i = 0; i < sign.size(); ++i) {
    const LocationEstimate& location = merged.locations[static_cast<std::size_t>(i)];
    if (parity == Parity::kOdd && location.y_norm < 0) sign(i) = -1;
    points.push_back(folded_position(location));
  }
  const Coincidence positions = coincidence(points);
  const Estimates mirrored = combined(estimates, sign.asDiagonal());
  const Folding onto_half = folding(mirrored, positions, parity, sign, merged.source);
  const Estimates observed = combined(mirrored, onto_half.shares);
  data.values = observed.values;
  data.covariance = observed.covariance;
  data.over_root_dof = observed.over_root_dof;
  data.excess = folded_excess(excess, positions, onto_half);
  data.offset_column =
      parity == Parity::kOdd ? VectorXd(onto_half.shares * sign) : VectorXd::Zero(data.size());
  for (const Index i : positions.kept) {
    data.labels.push_back(merged.locations[static_cast<std::size_t>(i)].label);
    data.points.push_back(points[static_cast<std::size_t>(i)]);
  }
  if (onto_half.with_differences) {
    data.labels.emplace_back("mirror images");
    data.points.emplace_back();
  }
  return data;
}

}  // namespace

FieldData thrust_change_data(const MapInput& merged) {
  const ThrustChange change = thrust_change(merged);
  const FieldData data = folded(merged, Parity::kEven, change.estimates, change.excess);
  const auto origin = std::find(data.labels.begin(), data.labels.end(),
                                merged.locations[index_of_origin(merged.locations)].label);
  return without(data, origin - data.labels.begin());
}

FieldData uneven_thrust_data(const MapInput& merged) {
  const auto n = static_cast<Index>(merged.locations.size());
  return folded(merged, Parity::kOdd,
                {values_of(merged.locations, &LocationEstimate::u_percent), merged.u_covariance,
                 merged.u_over_root_dof},
                MatrixXd::Identity(n, n));
}

FieldData without(const FieldData& data, Index left_out) {
  FieldData rest{.parity = data.parity, .scatter_known = data.scatter_known};
  std::vector<Index> kept;
  for (Index i = 0; i < data.size(); ++i) {
    if (i == left_out) continue;
    kept.push_back(i);
    rest.labels.push_back(data.labels[static_cast<std::size_t>(i)]);
    rest.points.push_back(data.points[static_cast<std::size_t>(i)]);
  }
  rest.values = data.values(kept);
  rest.covariance = data.covariance(kept, kept);
  rest.excess = data.excess(kept, kept);
  rest.offset_column = data.offset_column(kept);
  for (const MatrixXd& source : data.over_root_dof) rest.over_root_dof.emplace_back(source(kept, kept));
  return rest;
}

double thrust_coefficient_at_origin(const MapInput& merged) {
  return merged.locations[index_of_origin(merged.locations)].c_t;
}

double effective_dof(const std::vector<MatrixXd>& over_root_dof, const VectorXd& weights, double variance) {
  double over_dof = 0;
  for (const MatrixXd& source : over_root_dof) over_dof += std::pow(weights.dot(source * weights), 2);
  return over_dof > 0 ? std::max(1.0, variance * variance / over_dof)
                      : std::numeric_limits<double>::infinity();
}

std::vector<MeasuredLocation> measured_locations(const MapInput& merged) {
  const Estimates change = thrust_change(merged).estimates;
  const auto u95 = [&](const MatrixXd& covariance, const std::vector<MatrixXd>& over_root_dof, Index i) {
    if (!merged.scatter_known) return std::numeric_limits<double>::quiet_NaN();
    const double variance = std::max(0.0, covariance(i, i));
    return half_width_95(std::sqrt(variance),
                         effective_dof(over_root_dof, VectorXd::Unit(covariance.rows(), i), variance));
  };
  std::vector<MeasuredLocation> locations;
  for (const LocationEstimate& location : merged.locations) {
    const auto i = static_cast<Index>(locations.size());
    locations.push_back({.label = location.label,
                         .y_norm = location.y_norm,
                         .z_norm = location.z_norm,
                         .delta_ct_percent = change.values(i),
                         .delta_ct_u95_percent = u95(change.covariance, change.over_root_dof, i),
                         .uneven_thrust_percent = location.u_percent,
                         .uneven_thrust_u95_percent = u95(merged.u_covariance, merged.u_over_root_dof, i)});
  }
  return locations;
}

}  // namespace tunnelrig
