#include "flight/localisation/scan_section.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace tunnelrig {
namespace {

constexpr double kLeast_range_m = 0.02;
constexpr std::size_t kFewest = 10;

/// Ramer–Douglas–Peucker: marks the points of (first, last) that are needed to stay within the tolerance.
void mark(const std::vector<SectionPoint>& points, double tolerance_m, std::vector<bool>& needed) {
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, points.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    const SectionPoint along = (points[last] - points[first]).normalized();
    double most = tolerance_m;
    std::size_t at = 0;
    for (std::size_t i = first + 1; i < last; ++i) {
      const SectionPoint to = points[i] - points[first];
      const double away = std::abs(along.x() * to.y() - along.y() * to.x());
      if (away <= most) continue;
      most = away;
      at = i;
    }
    if (at == 0) continue;
    needed[at] = true;
    open.emplace_back(first, at);
    open.emplace_back(at, last);
  }
}

}  // namespace

CrossSection section_from_scan(const Scan& scan, const BeamLayout& layout,
                               const ScanSectionSettings& settings) {
  if (scan.range_m.size() != layout.beams)
    throw InputError::in("reference scan", "{} beams: its layout has {}", scan.range_m.size(), layout.beams);
  std::vector<SectionPoint> points;
  for (std::size_t i = 0; i < layout.beams; ++i) {
    const double range = scan.range_m[i];
    if (std::isnan(range)) throw InputError::in("reference scan", "beam {} is not a number", i);
    if (!(range > kLeast_range_m && range < settings.most_range_m)) continue;
    const double angle = layout.angle_rad(i);
    points.emplace_back(range * std::cos(angle), range * std::sin(angle));
  }
  if (points.size() < kFewest)
    throw InputError::in("reference scan", "{} returns: at least {} make a section", points.size(), kFewest);
  std::vector<bool> needed(points.size());
  needed.front() = needed.back() = true;
  mark(points, settings.tolerance_m, needed);
  std::vector<SectionPoint> outline;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (needed[i]) outline.push_back(points[i]);

  // The rest of the turn, so that the LIDAR stands inside
  const double last_rad = layout.angle_rad(layout.beams - 1);
  const double gap = 2 * std::numbers::pi - (last_rad - layout.first_rad);
  const int steps = static_cast<int>(std::ceil(gap / 0.6));
  for (int i = 1; i < steps; ++i) {
    const double angle = last_rad + gap * i / steps;
    outline.emplace_back(settings.behind_m * std::cos(angle), settings.behind_m * std::sin(angle));
  }
  return CrossSection(std::move(outline), "reference scan");
}

}  // namespace tunnelrig
