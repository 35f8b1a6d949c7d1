// What every fitted field answers, whichever method fitted it.
//
// A fitted field is a small struct with
//   FieldEstimate at(const TunnelPoint& point) const;
//   std::vector<LeftOut> leave_one_out() const;
// and is exactly 0 at OT, exactly even or odd in ȳ, and defined on [−1, 1]² only.
#pragma once

#include "analysis/maps/disturbance_map.h"
#include "datasets/locations.h"

#include <limits>
#include <string>
#include <vector>

namespace tunnelrig {

/// The field at one point, per cent.
struct FieldEstimate {
  double value = 0;
  double standard_uncertainty = 0;                       // NaN: not known
  double dof = std::numeric_limits<double>::infinity();  // of it, Welch–Satterthwaite

  double u95() const;  // half width of the 95 % interval
};

/// The field at one location by its own measurement, without what the locations around it say of it.
struct MeasuredField {
  std::string label;
  TunnelPoint point;  // folded onto ȳ ≥ 0, and the value with it
  FieldEstimate field;
};

/// One location, predicted by the field fitted with the same hyperparameters to all others; per cent.
struct LeftOut {
  std::string label;
  double measured = 0;
  double predicted = 0;
  double standard_uncertainty = 0;  // of measured − predicted
};

LeaveOneOutSummary summarize(const std::vector<LeftOut>& left_out);

/// Throws InputError for a point outside [−1, 1]²: no field extrapolates.
void require_inside(const TunnelPoint& point);

}  // namespace tunnelrig
