#include "analysis/maps/contours.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>
#include <utility>

namespace tunnelrig {
namespace {

/// The edges that a level crosses, joined by directed segments, one per cell or two at a saddle. As the
/// higher values are on the left of a segment in both cells that share an edge, it ends a segment in one of
/// them and begins one in the other, so that each crossed edge has at most one successor.
class Crossings {
 public:
  Crossings(const MapGrid& grid, const std::vector<double>& values, double level)
      : grid_(grid),
        values_(values),
        level_(level),
        columns_(grid.y_norm.size()),
        successor_(2 * grid.nodes()),
        has_predecessor_(2 * grid.nodes(), false) {
    for (std::size_t row = 0; row + 1 < grid.z_norm.size(); ++row) {
      for (std::size_t column = 0; column + 1 < columns_; ++column) add_cell(row, column);
    }
  }

  std::vector<ContourLine> lines() {
    std::vector<ContourLine> lines;
    for (const bool closed : {false, true}) {  // the open lines first, so that what is left is closed
      for (std::size_t edge = 0; edge < successor_.size(); ++edge) {
        if (!successor_[edge] || (!closed && has_predecessor_[edge])) continue;
        ContourLine line = follow(edge);
        if (line.points.size() > 1) lines.push_back(std::move(line));
      }
    }
    return lines;
  }

 private:
  // Edge 2n leads from node n to the right, edge 2n + 1 from node n upwards.
  void add_cell(std::size_t row, std::size_t column) {
    const std::size_t node = grid_.index(row, column);
    const std::array<std::size_t, 4> corner = {node, node + 1, node + 1 + columns_, node + columns_};
    const std::array<std::size_t, 4> edge = {2 * node, 2 * (node + 1) + 1, 2 * (node + columns_),
                                             2 * node + 1};
    const auto high = [&](std::size_t i) { return values_[corner[i % 4]] >= level_; };
    const double middle =
        (values_[corner[0]] + values_[corner[1]] + values_[corner[2]] + values_[corner[3]]) / 4;
    // Counter-clockwise round the cell, a segment begins on an edge where the corners change from high to
    // low, and ends on the next one where they change back. At a saddle, with two of each, that cuts off the
    // low corner, which is right where the middle is high; else the segment goes back round the high corner.
    for (std::size_t begin = 0; begin < 4; ++begin) {
      if (!high(begin) || high(begin + 1)) continue;
      const bool saddle = high(begin + 2) && !high(begin + 3);
      std::size_t end = begin + (saddle && middle < level_ ? 3 : 1);
      while (high(end) || !high(end + 1)) ++end;
      successor_[edge[begin]] = edge[end % 4];
      has_predecessor_[edge[end % 4]] = true;
    }
  }

  TunnelPoint point(std::size_t edge) const {
    const std::size_t from = edge / 2, to = edge % 2 == 0 ? from + 1 : from + columns_;
    const double t = (level_ - values_[from]) / (values_[to] - values_[from]);
    const auto y = [&](std::size_t node) { return grid_.y_norm[node % columns_]; };
    const auto z = [&](std::size_t node) { return grid_.z_norm[node / columns_]; };
    return {y(from) + t * (y(to) - y(from)), z(from) + t * (z(to) - z(from))};
  }

  /// Takes the line that begins at an edge out of the segments.
  ContourLine follow(std::size_t edge) {
    ContourLine line{.level = level_};
    for (std::optional<std::size_t> at = edge; at;) {
      const TunnelPoint next = point(*at);
      // Edges that meet at a node of just this level give the same point.
      if (line.points.empty() || next.y_norm != line.points.back().y_norm ||
          next.z_norm != line.points.back().z_norm) {
        line.points.push_back(next);
      }
      at = std::exchange(successor_[*at], std::nullopt);
    }
    return line;
  }

  const MapGrid& grid_;
  const std::vector<double>& values_;
  double level_;
  std::size_t columns_;
  std::vector<std::optional<std::size_t>> successor_;
  std::vector<bool> has_predecessor_;
};

}  // namespace

std::vector<ContourLine> contour_lines(const MapGrid& grid, const std::vector<double>& values, double level) {
  assert(values.size() == grid.nodes());
  return Crossings(grid, values, level).lines();
}

double nice_step(double at_least) {
  const double decade = std::pow(10, std::floor(std::log10(at_least)));
  for (const double nice : {1.0, 2.0, 2.5, 5.0}) {
    if (nice * decade >= at_least) return nice * decade;
  }
  return 10 * decade;
}

std::vector<double> contour_levels(const std::vector<double>& values, double step) {
  const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
  // To twelve digits of the step, so that three times 0.1 is 0.3.
  const double digits = std::pow(10, 12 - std::floor(std::log10(step)));
  std::vector<double> levels;
  for (double i = std::floor(*least / step); i * step < *greatest; ++i) {
    const double level = std::round(i * step * digits) / digits + 0.0;
    if (level > *least) levels.push_back(level);
  }
  return levels;
}

std::vector<ContourLine> contour_plot(const MapGrid& grid, const std::vector<double>& values, int most) {
  const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
  if (*least == *greatest) return {};
  std::vector<ContourLine> lines;
  for (const double level : contour_levels(values, nice_step((*greatest - *least) / most))) {
    for (ContourLine& line : contour_lines(grid, values, level)) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace tunnelrig
