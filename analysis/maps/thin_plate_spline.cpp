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

/// Without the locations that symmetry decides, which a spline cannot pass through.
FieldData decidable(FieldData data) {
  for (Index i = data.size() - 1; i >= 0 && data.parity == Parity::kOdd; --i) {
    if (data.points[static_cast<std::size_t>(i)].y_norm == 0) data = without(data, i);
  }
  return data;
}

}  // namespace

ThinPlateSpline::ThinPlateSpline(FieldData data) : data_(decidable(std::move(data))) {
  // Σ_j w_j φ(x_i, x_j) + b s(x_i) = f_i and Σ_j w_j s(x_j) = 0; that the weights of OT and of the mirror
  // images sum up to 0 as well is in the anchored kernel.
  const Index n = data_.size();
  MatrixXd conditions = MatrixXd::Zero(n + 1, n + 1);
  for (Index i = 0; i < n; ++i) conditions.row(i) = basis(data_.points[static_cast<std::size_t>(i)]);
  conditions.row(n).head(n) = conditions.col(n).head(n);
  inverse_ = conditions.fullPivLu().inverse();
}

VectorXd ThinPlateSpline::basis(const TunnelPoint& point) const {
  VectorXd basis(data_.size() + 1);
  for (Index i = 0; i < data_.size(); ++i) {
    basis(i) = anchored(thin_plate, data_.parity, point, data_.points[static_cast<std::size_t>(i)]);
  }
  basis(data_.size()) = slope(data_.parity, point);
  return basis;
}

FieldEstimate ThinPlateSpline::at(const TunnelPoint& point) const {
  require_inside(point);
  const VectorXd weights = (inverse_ * basis(point)).head(data_.size());  // of the measured values
  // All that a spline's uncertainty is made of is the measured covariance.
  if (!data_.scatter_known) return {weights.dot(data_.values), std::numeric_limits<double>::quiet_NaN()};
  const double variance = std::max(0.0, weights.dot(data_.covariance * weights));
  return {weights.dot(data_.values), std::sqrt(variance),
          effective_dof(data_.over_root_dof, weights, variance)};
}

std::vector<LeftOut> ThinPlateSpline::leave_one_out() const {
  // measured − predicted = (A⁻¹ f)_i / (A⁻¹)_ii (Dubrule 1983, "Cross validation of kriging in a unique
  // neighborhood").
  std::vector<LeftOut> result;
  for (Index i = 0; i < data_.size(); ++i) {
    double others = 0;
    for (Index j = 0; j < data_.size(); ++j) {
      if (j != i) others += std::abs(slope(data_.parity, data_.points[static_cast<std::size_t>(j)]));
    }
    if (others == 0) continue;
    const VectorXd weights = inverse_.row(i).head(data_.size()) / inverse_(i, i);
    const double error = weights.dot(data_.values);
    result.push_back(
        {.label = data_.labels[static_cast<std::size_t>(i)],
         .measured = data_.values(i),
         .predicted = data_.values(i) - error,
         .standard_uncertainty = std::sqrt(std::max(0.0, weights.dot(data_.covariance * weights)))});
  }
  return result;
}

}  // namespace tunnelrig
