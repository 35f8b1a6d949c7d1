// Contour lines of a field on a grid, by marching squares.
#pragma once

#include "analysis/maps/disturbance_map.h"
#include "datasets/locations.h"

#include <vector>

namespace tunnelrig {

/// One contour line. Walking along it, ȳ to the right and z̄ up, the higher values are on the left.
struct ContourLine {
  double level = 0;
  std::vector<TunnelPoint> points;  // at least two; a closed line ends with its first point

  bool closed() const {
    return points.front().y_norm == points.back().y_norm && points.front().z_norm == points.back().z_norm;
  }
};

/// All lines of one level. `values` holds one finite value for each node of the grid. Every point is on an
/// edge of the grid, where linear interpolation between the two nodes gives the level; a line is closed, or
/// begins and ends on the border. In a cell whose corners are high and low in turn, the mean of the four
/// decides which are joined.
std::vector<ContourLine> contour_lines(const MapGrid& grid, const std::vector<double>& values, double level);

/// The least multiple of 1, 2, 2.5 or 5 times a power of ten that is not below a positive number.
double nice_step(double at_least);

/// The multiples of a step between the least and the greatest value, exclusive.
std::vector<double> contour_levels(const std::vector<double>& values, double step);

/// The lines of at most `most` levels, a nice step apart; none where all values are equal.
std::vector<ContourLine> contour_plot(const MapGrid& grid, const std::vector<double>& values, int most);

}  // namespace tunnelrig
