#include "analysis/maps/field_estimate.h"

#include "calibration/distributions.h"
#include "datasets/error.h"

#include <cmath>

namespace tunnelrig {

double FieldEstimate::u95() const {  // NaN where that of the field is
  return half_width_95(standard_uncertainty, dof);
}

LeaveOneOutSummary summarize(const std::vector<LeftOut>& left_out) {
  if (left_out.empty()) return {};
  double squares = 0, standardised_squares = 0;
  for (const LeftOut& location : left_out) {
    const double error = location.measured - location.predicted;
    squares += error * error;
    standardised_squares += std::pow(error / location.standard_uncertainty, 2);
  }
  const auto n = static_cast<double>(left_out.size());
  LeaveOneOutSummary summary{.locations = static_cast<int>(left_out.size()),
                             .rms_percent = std::sqrt(squares / n)};
  if (std::isfinite(standardised_squares)) summary.standardised_rms = std::sqrt(standardised_squares / n);
  return summary;
}

void require_inside(const TunnelPoint& point) {
  if (std::abs(point.y_norm) <= 1 && std::abs(point.z_norm) <= 1) return;
  throw InputError(fmt::format("the map ends at the walls, -1 to 1, and refuses to extrapolate to ({}, {})",
                               point.y_norm, point.z_norm));
}

}  // namespace tunnelrig
