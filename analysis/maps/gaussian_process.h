// The default map: Gaussian-process regression with the measured covariance as its noise.
#pragma once

#include "analysis/maps/field_data.h"
#include "analysis/maps/field_estimate.h"
#include "analysis/maps/rig_offset.h"

#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace tunnelrig {

/// What the field is taken to be before it is measured.
struct Hyperparameters {
  double amplitude_percent = 1;  // standard deviation of the field far from ȳ = 0, before OT is taken off
  double length_y = 1;           // correlation lengths, in normalised coordinates
  double length_z = 1;
  /// Scatter between locations that neither the measured covariance nor a field of these lengths explains: an
  /// error without a budget, or structure finer than the locations. It is smoothed in the map's value, as an
  /// error, and counts in the map's uncertainty, as structure.
  double excess_percent = 0;
};

/// Matérn 5/2 covariance at a distance, and its derivatives by ln(length_y) and ln(length_z).
/// Rasmussen & Williams (2006), (4.17).
Eigen::Array3d matern(const Hyperparameters& h, double dy, double dz);

/// Covariance of the observations' errors: the measured one and the excess.
Eigen::MatrixXd noise_covariance(const FieldData& data, const Hyperparameters& hyperparameters);

/// Posterior of a field under given hyperparameters, and of the rig's offset beside it, of which nothing is
/// known before. Rasmussen & Williams (2006), (2.25), (2.26), (2.42).
class GaussianProcess {
 public:
  GaussianProcess(FieldData data, const Hyperparameters& hyperparameters);

  /// Throws InputError outside [−1, 1]².
  FieldEstimate at(const TunnelPoint& point) const;

  /// The rig's offset, which is in the measured values and not in the field; nothing where no location shows
  /// it.
  std::optional<FieldEstimate> offset() const;

  /// Every measured value less that offset.
  std::vector<MeasuredField> measured() const { return less_offset(offset_, data_); }

  /// In closed form. What is predicted is the measurement, with the error that it shares with the others as
  /// far as those show it. An odd field's locations on ȳ = 0 are not listed: symmetry alone decides there.
  std::vector<LeftOut> leave_one_out() const;

  const Hyperparameters& hyperparameters() const { return hyperparameters_; }

 private:
  double covariance(const TunnelPoint& a, const TunnelPoint& b) const;
  Eigen::VectorXd covariance_with_data(const TunnelPoint& point) const;

  FieldData data_;
  Hyperparameters hyperparameters_;
  Eigen::LLT<Eigen::MatrixXd> factor_;  // of the covariance of the observations, K + N
  Eigen::VectorXd offset_column_;
  OffsetWeights offset_;
  Eigen::VectorXd weights_;  // (K + N)⁻¹ (values less the offset)
};

}  // namespace tunnelrig
