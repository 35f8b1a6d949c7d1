#include "analysis/maps/contour_labels.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

constexpr double kShortest = 0.35;  // length of a line worth a label

/// Distance of two points in label sizes: below 1 a label at one covers the other.
double label_distance(const TunnelPoint& a, const TunnelPoint& b, const LabelSize& size) {
  return std::max(std::abs(a.y_norm - b.y_norm) / size.half_width,
                  std::abs(a.z_norm - b.z_norm) / size.half_height);
}

double length(const ContourLine& line) {
  double sum = 0;
  for (std::size_t i = 1; i < line.points.size(); ++i) {
    sum += std::hypot(line.points[i].y_norm - line.points[i - 1].y_norm,
                      line.points[i].z_norm - line.points[i - 1].z_norm);
  }
  return sum;
}

double nearest(const TunnelPoint& at, const std::vector<TunnelPoint>& points, const LabelSize& size) {
  double least = 1e9;
  for (const TunnelPoint& point : points) least = std::min(least, label_distance(at, point, size));
  return least;
}

}  // namespace

std::vector<ContourLabel> place_labels(const std::vector<ContourLine>& lines,
                                       const std::vector<TunnelPoint>& marks, const LabelSize& size) {
  std::vector<ContourLabel> labels;
  std::vector<TunnelPoint> taken;
  for (const ContourLine& line : lines) {
    if (length(line) < kShortest) continue;
    double best = 1;  // the least clearance that is good enough
    const TunnelPoint* place = nullptr;
    for (const TunnelPoint& at : line.points) {
      const double from_border =
          std::min((1 - std::abs(at.y_norm)) / size.half_width, (1 - std::abs(at.z_norm)) / size.half_height);
      // Two labels want twice the room of one; other lines may be near, but not in the way.
      double clearance =
          std::min({from_border, nearest(at, marks, size), 0.5 * nearest(at, taken, size), 3.0});
      for (const ContourLine& other : lines) {
        if (&other != &line) clearance = std::min(clearance, 1 + nearest(at, other.points, size));
      }
      if (clearance <= best) continue;
      best = clearance;
      place = &at;
    }
    if (place == nullptr) continue;
    labels.push_back({*place, line.level});
    taken.push_back(*place);
  }
  return labels;
}

}  // namespace tunnelrig
