#include "flight/tunnel/shapes.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace tunnelrig {

std::vector<SectionPoint> box_outline(double width_m, double height_m) {
  const double y = width_m / 2;
  const double z = height_m / 2;
  return {{-y, -z}, {y, -z}, {y, z}, {-y, z}};
}

std::vector<SectionPoint> arch_outline(double width_m, double height_m, double wall_height_m, int segments) {
  const double y = width_m / 2;
  const double floor = -height_m / 2;
  const double spring = floor + wall_height_m;
  const double rise = height_m - wall_height_m;
  std::vector<SectionPoint> outline{{-y, floor}, {y, floor}};
  for (int i = 0; i <= segments; ++i) {
    const double angle = std::numbers::pi * i / segments;
    outline.emplace_back(y * std::cos(angle), spring + rise * std::sin(angle));
  }
  return outline;
}

std::vector<SectionPoint> circle_outline(double diameter_m, int segments) {
  const double step = 2 * std::numbers::pi / segments;
  const double radius = diameter_m / 2 * std::sqrt(step / std::sin(step));
  std::vector<SectionPoint> outline;
  outline.reserve(static_cast<std::size_t>(segments));
  for (int i = 0; i < segments; ++i)
    outline.emplace_back(radius * std::cos((i + 0.5) * step), radius * std::sin((i + 0.5) * step));
  return outline;
}

std::vector<SectionPoint> with_features(const std::vector<SectionPoint>& outline,
                                        std::vector<SectionFeature> features, const std::string& name) {
  std::sort(features.begin(), features.end(), [](const SectionFeature& a, const SectionFeature& b) {
    return std::tie(a.edge, a.from_m) < std::tie(b.edge, b.from_m);
  });
  std::vector<SectionPoint> result;
  std::size_t next = 0;
  for (std::size_t edge = 0; edge < outline.size(); ++edge) {
    const SectionPoint& start = outline[edge];
    const SectionPoint whole = outline[(edge + 1) % outline.size()] - start;
    const SectionPoint along = whole.normalized();
    const SectionPoint inward(-along.y(), along.x());
    result.push_back(start);
    double used = 0;
    for (; next < features.size() && features[next].edge == edge; ++next) {
      const SectionFeature& f = features[next];
      if (!(f.from_m > used && f.to_m > f.from_m && f.to_m < whole.norm() && f.inward_m != 0))
        throw InputError::in(
            name,
            "the feature from {} to {} m on edge {}: features lie apart, within their edge of "
            "{:.3f} m, and reach in or out",
            f.from_m, f.to_m, edge, whole.norm());
      for (const auto& [distance, depth] :
           {std::pair{f.from_m, 0.0}, {f.from_m, f.inward_m}, {f.to_m, f.inward_m}, {f.to_m, 0.0}})
        result.emplace_back(start + distance * along + depth * inward);
      used = f.to_m;
    }
  }
  if (next < features.size())
    throw InputError::in(name, "a feature stands on edge {}: the outline has edges 0 to {}",
                         features[next].edge, outline.size() - 1);
  return result;
}

std::vector<SectionPoint> centred(std::vector<SectionPoint> outline) {
  SectionPoint lowest = outline.front();
  SectionPoint highest = outline.front();
  for (const SectionPoint& point : outline) {
    lowest = lowest.cwiseMin(point);
    highest = highest.cwiseMax(point);
  }
  const SectionPoint middle = (lowest + highest) / 2;
  for (SectionPoint& point : outline) point -= middle;
  return outline;
}

}  // namespace tunnelrig
