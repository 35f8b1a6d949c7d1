// The other map: the thin-plate spline that passes through every measured value.
#pragma once

#include "analysis/maps/field_data.h"
#include "analysis/maps/field_estimate.h"
#include "analysis/maps/rig_offset.h"

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// The surface of least bending through the measured values and their mirror images (Duchon 1977; Wahba 1990,
/// chapter 2). Its uncertainty is the measured covariance carried through the interpolation's weights: what
/// the field does between the locations is not in it. An odd field is 0 on ȳ = 0 whatever was measured there;
/// what was is the rig's offset, and taken off the measured values first.
class ThinPlateSpline {
 public:
  explicit ThinPlateSpline(FieldData data);

  /// Throws InputError outside [−1, 1]².
  FieldEstimate at(const TunnelPoint& point) const;

  /// The rig's offset, which is in the measured values and not in the field; nothing where no location shows
  /// it.
  std::optional<FieldEstimate> offset() const;

  /// Every measured value less that offset.
  std::vector<MeasuredField> measured() const { return less_offset(offset_, data_); }

  /// In closed form. A location that alone decides the spline's slope cannot be left out and is not listed,
  /// nor is one where symmetry alone decides.
  std::vector<LeftOut> leave_one_out() const;

 private:
  const TunnelPoint& point_of(Eigen::Index row) const;
  Eigen::VectorXd basis(const TunnelPoint& point) const;

  /// From weights of the interpolated field to those of all measured values, the offset's share among them.
  Eigen::VectorXd measured_weights(const Eigen::VectorXd& weights) const;

  /// A weighted sum of the measured values.
  FieldEstimate estimate(const Eigen::VectorXd& weights) const;

  FieldData data_;
  std::vector<Eigen::Index> through_;  // the m of the n locations that symmetry does not decide
  Eigen::VectorXd offset_column_;
  OffsetWeights offset_;
  Eigen::MatrixXd inverse_;  // of the interpolation conditions, (m + 1) × (m + 1)
};

}  // namespace tunnelrig
