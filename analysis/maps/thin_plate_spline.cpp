#include "analysis/maps/thin_plate_spline.h"

#include "analysis/maps/symmetric_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// r² ln r
double thin_plate(double dy, double dz) {
  const double square = dy * dy + dz * dz;
  return square > 0 ? 0.5 * square * std::log(square) : 0;
}

/// The part of a plane that has the field's symmetry and is 0 at OT.
double slope(Parity parity, const TunnelPoint& point) {
  return parity == Parity::kEven ? point.z_norm : point.y_norm;
}

/// The locations that symmetry does not decide; through the others a spline cannot pass.
std::vector<Index> decidable(const FieldData& data) {
  std::vector<Index> locations;
  for (Index i = 0; i < data.size(); ++i) {
    if (data.parity == Parity::kEven || data.points[static_cast<std::size_t>(i)].y_norm != 0)
      locations.push_back(i);
  }
  return locations;
}

}  // namespace

ThinPlateSpline::ThinPlateSpline(FieldData data)
    : data_(std::move(data)),
      through_(decidable(data_)),
      offset_column_(column_of_offset(data_)),
      offset_(offset_weights_on_centre_line(data_)) {
  // Σ_j w_j φ(x_i, x_j) + b s(x_i) = f_i and Σ_j w_j s(x_j) = 0; that the weights of OT and of the mirror
  // images sum up to 0 as well is in the anchored kernel.
  const auto m = static_cast<Index>(through_.size());
  MatrixXd conditions = MatrixXd::Zero(m + 1, m + 1);
  for (Index row = 0; row < m; ++row) conditions.row(row) = basis(point_of(row));
  conditions.row(m).head(m) = conditions.col(m).head(m);
  inverse_ = conditions.fullPivLu().inverse();
}

const TunnelPoint& ThinPlateSpline::point_of(Index row) const {
  return data_.points[static_cast<std::size_t>(through_[static_cast<std::size_t>(row)])];
}

VectorXd ThinPlateSpline::basis(const TunnelPoint& point) const {
  const auto m = static_cast<Index>(through_.size());
  VectorXd basis(m + 1);
  for (Index row = 0; row < m; ++row) basis(row) = anchored(thin_plate, data_.parity, point, point_of(row));
  basis(m) = slope(data_.parity, point);
  return basis;
}

VectorXd ThinPlateSpline::measured_weights(const VectorXd& weights) const {
  VectorXd result = VectorXd::Zero(data_.size());
  result(through_) = weights;
  return result - result.dot(offset_column_) * offset_.weights;
}

FieldEstimate ThinPlateSpline::estimate(const VectorXd& weights) const {
  // All that a spline's uncertainty is made of is the measured covariance.
  if (!data_.scatter_known) return {weights.dot(data_.values), std::numeric_limits<double>::quiet_NaN()};
  const double variance = std::max(0.0, weights.dot(data_.covariance * weights));
  return {weights.dot(data_.values), std::sqrt(variance),
          effective_dof(data_.over_root_dof, weights, variance)};
}

FieldEstimate ThinPlateSpline::at(const TunnelPoint& point) const {
  require_inside(point);
  return estimate(measured_weights((inverse_ * basis(point)).head(static_cast<Index>(through_.size()))));
}

std::optional<FieldEstimate> ThinPlateSpline::offset() const {
  if (!offset_.weights.any()) return {};
  return estimate(offset_.weights);
}

std::vector<LeftOut> ThinPlateSpline::leave_one_out() const {
  // measured − predicted = (A⁻¹ f)_i / (A⁻¹)_ii (Dubrule 1983, "Cross validation of kriging in a unique
  // neighborhood"), f less the offset, which no location off ȳ = 0 has a share in.
  std::vector<LeftOut> result;
  const auto m = static_cast<Index>(through_.size());
  for (Index row = 0; row < m; ++row) {
    double others = 0;
    for (Index other = 0; other < m; ++other) {
      if (other != row) others += std::abs(slope(data_.parity, point_of(other)));
    }
    if (others == 0) continue;
    const Index i = through_[static_cast<std::size_t>(row)];
    const FieldEstimate error =
        estimate(measured_weights(inverse_.row(row).head(m).transpose() / inverse_(row, row)));
    result.push_back({.label = data_.labels[static_cast<std::size_t>(i)],
                      .measured = data_.values(i),
                      .predicted = data_.values(i) - error.value,
                      .standard_uncertainty = error.standard_uncertainty});
  }
  return result;
}

}  // namespace tunnelrig
