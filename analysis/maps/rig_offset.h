// A constant offset of the rig: what it reads of an odd quantity where symmetry demands 0.
//
// One pair of rotors that is stronger everywhere (propellers without factors, arms, cells) adds the same β to
// U at every location. No field that is odd in ȳ is a constant, but off the middle one can come close. So β
// is estimated together with the field, by generalised least squares with one more column h that nothing is
// assumed of (Rasmussen & Williams 2006, section 2.7; universal kriging). Locations on ȳ = 0, where the field
// is 0, show it; the declared covariance need not know of it.
#pragma once

#include "analysis/maps/field_data.h"
#include "analysis/maps/field_estimate.h"

#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace tunnelrig {

/// β̂ = weights · values, percentage points. Where there is none, weights and variance are 0.
struct OffsetWeights {
  Eigen::VectorXd weights;  // n
  double variance = 0;      // square percentage points
};

/// The column h: offset_column of the data, or zeros where no location on ȳ = 0 shows the offset, which then
/// cannot be told from a field and counts as 0.
Eigen::VectorXd column_of_offset(const FieldData& data);

/// β̂ where K is the covariance of values and field: weights K⁻¹h / (hᵀK⁻¹h), variance 1 / (hᵀK⁻¹h).
OffsetWeights offset_weights(const Eigen::LLT<Eigen::MatrixXd>& factor, const Eigen::VectorXd& column);

/// P = K⁻¹ − K⁻¹h hᵀK⁻¹ / (hᵀK⁻¹h): what is left of the inverse of K, given, where the offset is free.
Eigen::MatrixXd without_offset(const Eigen::MatrixXd& inverse, const OffsetWeights& offset);

/// β̂ from the locations on ȳ = 0 alone, which takes no field to be known; by the measured covariance.
OffsetWeights offset_weights_on_centre_line(const FieldData& data);

/// β̂ of the data, per cent; nothing where no location shows it.
std::optional<FieldEstimate> estimate_of(const OffsetWeights& offset, const FieldData& data);

/// Every measured value off ȳ = 0 less the offset h β̂, which it may have had a part in: as an estimate of the
/// field there its error is e − h wᵀ(f + e), w being β̂'s weights, of the variance Σ − 2 h (Σ w) + u²(β̂).
std::vector<MeasuredField> less_offset(const OffsetWeights& offset, const FieldData& data);

}  // namespace tunnelrig
