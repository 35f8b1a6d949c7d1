// One load cell: the line from force to voltage, with its uncertainty, and back (docs/calibration.md).
#pragma once

#include "calibration/cell_checks.h"
#include "calibration/outliers.h"
#include "datasets/campaign.h"

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// What a point far from the line counts. All but the ordinary one take their scale from the median absolute
/// deviation of the residuals and have 95 % efficiency on normal noise.
enum class RobustLoss { kOrdinary, kHuber, kCauchy, kTukey };

struct LoadCellOptions {
  RobustLoss loss = RobustLoss::kOrdinary;
  double gauge_force_N = 0;  // standard uncertainty (k = 1) of one applied force, independent between points

  double confidence = 0.95;
  double suspicious_p = 0.01;  // points with a smaller Bonferroni p are named
  GrossRule gross;
  bool leave_out_gross = true;  // of the ordinary fit; a robust loss keeps and discounts them

  int max_iterations = 1000;  // of Ceres, in one round of variances
};

struct FitConvergence {
  bool converged = false;
  int iterations = 0;  // Ceres's, over all rounds
  std::string message;
};

/// One calibration point beside the line.
struct CellPoint {
  int line = 0;  // of calibration.csv
  double force_N = 0;
  double voltage_V = 0;
  double residual_N = 0;  // (voltage − zero)/gain − force
  double leverage = 0;    // 0 to 1
  double studentised = 0;
  double p = 1;       // Bonferroni
  double weight = 1;  // that the loss left it; 0 where it was left out
  bool suspicious = false;
  bool gross = false;
};

/// voltage = zero_V + gain_V_per_N · force, and what is known of it.
struct CellFit {
  int cell = 1;
  double zero_V = 0;
  double gain_V_per_N = 1;
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  // of (zero_V, gain_V_per_N), V² and V²/N
  double dof = 0;                                        // of the variance that scales the covariance
  FitConvergence convergence;

  RobustLoss loss = RobustLoss::kOrdinary;
  double gauge_force_N = 0;
  double confidence = 0.95;
  double residual_std_V = 0;  // of the points about the line: reading and gauge together
  double reading_std_V = 0;   // of the reading alone, √(residual_std_V² − gain² gauge_force_N²)
  double correlation = 0;     // of the points, as the fit weighs them
  double lowest_force_N = 0;
  double highest_force_N = 0;
  CellChecks checks;
  std::vector<CellPoint> points;  // all, in the order given

  int points_used() const;  // with a weight above 0
  double span_N() const { return highest_force_N - lowest_force_N; }
  double residual_std_N() const;
  double zero_u95_V() const;  // half widths at `confidence`, Student's t
  double gain_u95_V_per_N() const;
};

/// Fits the points of one cell: weighted least squares in Ceres of
///     voltage = zero + gain · force,  variance = (reading_std² + gain² gauge_force²) / weight,
/// the effective variance of Orear 1982 (Deming's fit where gauge_force_N > 0). reading_std² is what the
/// residual variance leaves after the gauge's share, and the two are iterated. `weights` are relative, one
/// per point (such as the number of readings that a point is the mean of); empty: all equal.
///
/// Throws InputError, naming cell and lines, for fewer than three points, forces that are all one, a value
/// that is not finite, a gauge that is not finer than half the spread of the forces, and a gain that cannot
/// be told from zero at `confidence`.
CellFit fit_load_cell(std::span<const CalibrationPoint> points, const LoadCellOptions& options = {},
                      std::span<const double> weights = {});

/// What a voltage says of the force.
struct ForcePrediction {
  double force_N = 0;
  double standard_uncertainty_N = 0;
  double lower_N = 0;  // interval that holds the force with the fit's `confidence`
  double upper_N = 0;
  bool extrapolated = false;  // outside the forces that the cell was calibrated with
};

/// What scatter a voltage has beside its standard error.
enum class ReadingScatter {
  kNone,           // a mean of many samples: its standard error is all
  kAsCalibration,  // one more reading like the calibration's
};

/// Force from a mean voltage with its standard error. The interval is Fieller's (the forces whose predicted
/// voltage the reading does not contradict; Fieller 1954), with the known and the estimated parts of the
/// variance propagated as distributions (GUM Supplement 1): it is Student's t where all is estimated.
ForcePrediction predict_force(const CellFit& fit, double voltage_V, double standard_error_V = 0,
                              ReadingScatter scatter = ReadingScatter::kNone);

}  // namespace tunnelrig
