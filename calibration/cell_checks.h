// What a load cell's points say about it beside zero and gain. Everything that the points do not allow to be
// said is absent.
#pragma once

#include "datasets/campaign.h"

#include <optional>
#include <span>

#include <Eigen/Core>

namespace tunnelrig {

/// Lack of fit: scatter of the group means about the line against scatter within groups of one force and
/// direction (Draper and Smith 1998, 2.1). Needs repeated forces and more than two groups.
struct LackOfFit {
  double f = 0;
  int dof_lack = 0;
  int dof_pure = 0;
  double p = 1;
};

/// t test of a quadratic term in force; needs four points at three forces.
struct Linearity {
  double curvature_V_per_N2 = 0;
  double p = 1;
  double bow_N = 0;            // distance of that parabola from its nearest line: |curvature| span²/(8 gain)
  double max_deviation_N = 0;  // largest distance of a force's mean reading from the fitted line
  double max_deviation_percent_of_span = 0;
};

/// Readings on the way down minus those on the way up at one force, by a common offset in the line; needs two
/// points in each direction.
struct Hysteresis {
  double down_minus_up_N = 0;
  double standard_uncertainty_N = 0;
  double p = 1;
  double percent_of_span = 0;
  std::optional<double> largest_N;  // difference at a force that was taken both ways
};

/// Scatter of readings of one force in one direction, pooled.
struct Repeatability {
  double std_N = 0;
  int dof = 0;
};

/// Last minus first reading of zero force, load in between; needs `sequence`.
struct ZeroReturn {
  double change_N = 0;
  double percent_of_span = 0;
};

/// Last minus first of consecutive readings of one force, the stretch with the largest change; needs
/// `sequence`.
struct Creep {
  double largest_N = 0;
  int stretches = 0;
  int longest = 0;  // readings
};

struct CellChecks {
  std::optional<LackOfFit> lack_of_fit;
  std::optional<Linearity> linearity;
  std::optional<Hysteresis> hysteresis;
  std::optional<Repeatability> repeatability;
  std::optional<ZeroReturn> zero_return;
  std::optional<Creep> creep;
};

/// Checks against the line voltage = line[0] + line[1] · force. `weights` as in fit_load_cell, one per point.
CellChecks check_cell(std::span<const CalibrationPoint> points, const Eigen::VectorXd& weights,
                      const Eigen::Vector2d& line);

}  // namespace tunnelrig
