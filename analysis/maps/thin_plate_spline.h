// The other map: the thin-plate spline that passes through every measured value.
#pragma once

#include "analysis/maps/field_data.h"
#include "analysis/maps/field_estimate.h"

#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// The surface of least bending through the measured values and their mirror images (Duchon 1977; Wahba 1990,
/// chapter 2). Its uncertainty is the measured covariance carried through the interpolation's weights: what
/// the field does between the locations is not in it. An odd field is 0 on ȳ = 0 whatever was measured there.
class ThinPlateSpline {
 public:
  explicit ThinPlateSpline(FieldData data);

  /// Throws InputError outside [−1, 1]².
  FieldEstimate at(const TunnelPoint& point) const;

  /// In closed form. A location that alone decides the spline's slope cannot be left out and is not listed,
  /// nor is one where symmetry alone decides.
  std::vector<LeftOut> leave_one_out() const;

 private:
  Eigen::VectorXd basis(const TunnelPoint& point) const;

  FieldData data_;
  Eigen::MatrixXd inverse_;  // of the interpolation conditions, (n + 1) × (n + 1)
};

}  // namespace tunnelrig
