#include "analysis/maps/measured_region.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>

namespace tunnelrig {
namespace {

constexpr double kOnTheBorder = 1e-9;  // of coordinates that were rounded

/// Twice the area of a, b, c; positive where they turn left.
double turn(const TunnelPoint& a, const TunnelPoint& b, const TunnelPoint& c) {
  return (b.y_norm - a.y_norm) * (c.z_norm - a.z_norm) - (b.z_norm - a.z_norm) * (c.y_norm - a.y_norm);
}

/// Half of a hull, of points in order (Andrew 1979).
std::vector<TunnelPoint> chain(const std::vector<TunnelPoint>& points) {
  std::vector<TunnelPoint> hull;
  for (const TunnelPoint& point : points) {
    while (hull.size() > 1 && turn(hull[hull.size() - 2], hull.back(), point) <= kOnTheBorder)
      hull.pop_back();
    hull.push_back(point);
  }
  return hull;
}

double from_line(const TunnelPoint& a, const TunnelPoint& b, const TunnelPoint& point) {
  const double length = std::hypot(b.y_norm - a.y_norm, b.z_norm - a.z_norm);
  return length > 0 ? turn(a, b, point) / length
                    : -std::hypot(point.y_norm - a.y_norm, point.z_norm - a.z_norm);
}

TunnelPoint between(const TunnelPoint& a, const TunnelPoint& b, double share) {
  return {a.y_norm + share * (b.y_norm - a.y_norm), a.z_norm + share * (b.z_norm - a.z_norm)};
}

/// The part of the line from a to b inside the region, as shares of the way (Cyrus and Beck 1978).
std::optional<std::pair<double, double>> inside(const MeasuredRegion& region, const TunnelPoint& a,
                                                const TunnelPoint& b) {
  const std::vector<TunnelPoint>& corners = region.corners();
  if (corners.size() < 3) return {};
  double from = 0, to = 1;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const TunnelPoint& corner = corners[i];
    const TunnelPoint& next = corners[(i + 1) % corners.size()];
    const double at_a = from_line(corner, next, a), at_b = from_line(corner, next, b);
    if (at_a < 0 && at_b < 0) return {};
    if (at_a < 0) from = std::max(from, at_a / (at_a - at_b));
    if (at_b < 0) to = std::min(to, at_a / (at_a - at_b));
  }
  return from < to ? std::optional(std::pair(from, to)) : std::nullopt;
}

}  // namespace

MeasuredRegion::MeasuredRegion(const std::vector<TunnelPoint>& locations) {
  std::vector<TunnelPoint> points = locations;
  for (const TunnelPoint& location : locations) points.push_back({-location.y_norm, location.z_norm});
  std::ranges::sort(points, {}, [](const TunnelPoint& p) { return std::pair(p.y_norm, p.z_norm); });
  corners_ = chain(points);
  std::ranges::reverse(points);
  const std::vector<TunnelPoint> upper = chain(points);
  if (!corners_.empty()) corners_.pop_back();
  corners_.insert(corners_.end(), upper.begin(), upper.empty() ? upper.end() : upper.end() - 1);
}

bool MeasuredRegion::holds(const TunnelPoint& point) const {
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const TunnelPoint& corner = corners_[i];
    const TunnelPoint& next = corners_[(i + 1) % corners_.size()];
    if (from_line(corner, next, point) < -kOnTheBorder) return false;
    // On a line, whose ends are the two corners, the way back turns the other side out.
    const double along = (point.y_norm - corner.y_norm) * (next.y_norm - corner.y_norm) +
                         (point.z_norm - corner.z_norm) * (next.z_norm - corner.z_norm);
    if (corners_.size() == 2 && along < -kOnTheBorder) return false;
  }
  return !corners_.empty();
}

double MeasuredRegion::share_outside() const {
  constexpr double kSquare = 4;
  double twice_area = 0;
  for (std::size_t i = 0; i < corners_.size(); ++i)
    twice_area += turn({}, corners_[i], corners_[(i + 1) % corners_.size()]);
  return std::clamp(1 - twice_area / 2 / kSquare, 0.0, 1.0);
}

MeasuredRegion measured_region(const DisturbanceMap& map) {
  std::vector<TunnelPoint> points;
  for (const MeasuredLocation& location : map.locations) points.push_back({location.y_norm, location.z_norm});
  return MeasuredRegion(points);
}

std::vector<std::vector<TunnelPoint>> hatching(const MeasuredRegion& region, double apart) {
  constexpr double kShortest = 0.02;  // of a line that is seen as one
  std::vector<std::vector<TunnelPoint>> lines;
  const auto add = [&lines](const TunnelPoint& a, const TunnelPoint& b) {
    if (std::hypot(b.y_norm - a.y_norm, b.z_norm - a.z_norm) > kShortest) lines.push_back({a, b});
  };
  const double step = apart * std::numbers::sqrt2;             // along the axis
  for (double rise = -2 + step / 2; rise < 2; rise += step) {  // z = y + rise
    const double from = std::max(-1.0, -1 - rise), to = std::min(1.0, 1 - rise);
    const TunnelPoint a{from, from + rise}, b{to, to + rise};
    if (const auto covered = inside(region, a, b)) {
      add(a, between(a, b, covered->first));
      add(between(a, b, covered->second), b);
    } else {
      add(a, b);
    }
  }
  return lines;
}

}  // namespace tunnelrig
