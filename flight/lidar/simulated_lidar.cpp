#include "flight/lidar/simulated_lidar.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

void check(const char* name, double value, double lowest, double highest) {
  if (!(value >= lowest && value <= highest))
    throw InputError::in("LIDAR", "{} is {}: it lies between {} and {}", name, value, lowest, highest);
}

}  // namespace

SimulatedLidar::SimulatedLidar(const CrossSection& section, const LidarSettings& settings, std::uint64_t seed)
    : section_(section), settings_(settings), random_(seed) {
  check("beams", static_cast<double>(settings.layout.beams), 2, 100000);
  check("rate_hz", settings.rate_hz, 0.1, 1000);
  check("sweep_s", settings.sweep_s, 0, 1 / settings.rate_hz);
  check("range_sigma_m", settings.range_sigma_m, 0, 1);
  check("least_range_m", settings.least_range_m, 0, 10);
  check("most_range_m", settings.most_range_m, settings.least_range_m, 1000);
  check("resolution_m", settings.resolution_m, 0, 1);
  check("dropout_share", settings.dropout_share, 0, 1);
  check("puddle_mirror_share", settings.puddle_mirror_share, 0, 1);
  for (std::size_t i = 0; i < settings.layout.beams; ++i) {
    const double angle = settings.layout.angle_rad(i);
    directions_.emplace_back(std::cos(angle), std::sin(angle));
  }
}

Scan SimulatedLidar::sweep(std::span<const LidarPose> path) {
  if (path.size() < 2) throw InputError::in("LIDAR", "a sweep along {} poses: it has two ends", path.size());
  // Between poses the projection is linear too: a turn of a degree bends the beams by less than 0.1 mrad
  // more.
  std::vector<Eigen::Matrix2d> projections;
  for (const LidarPose& pose : path) projections.push_back(section_projection(pose.attitude));
  Scan scan;
  scan.range_m.reserve(directions_.size());
  const double pieces = static_cast<double>(path.size() - 1) / static_cast<double>(directions_.size() - 1);
  for (std::size_t i = 0; i < directions_.size(); ++i) {
    const double at = static_cast<double>(i) * pieces;
    const std::size_t piece = std::min(static_cast<std::size_t>(at), path.size() - 2);
    const double part = at - static_cast<double>(piece);
    const SectionPoint from = path[piece].position + part * (path[piece + 1].position - path[piece].position);
    const Eigen::Matrix2d projection =
        projections[piece] + part * (projections[piece + 1] - projections[piece]);
    scan.range_m.push_back(static_cast<float>(measured_m(range_m(from, projection * directions_[i]))));
  }
  return scan;
}

/// The direction's length is the cosine between beam and cross-section, so the section's distance comes out
/// as range.
double SimulatedLidar::range_m(const SectionPoint& from, const SectionPoint& direction) {
  const double to_wall = section_.ray(from, direction);
  const double hit_z = from.y() + to_wall * direction.y();
  if (!(hit_z < settings_.puddle_top_m)) return to_wall;
  if (from.y() <= settings_.puddle_top_m || random_.uniform() >= settings_.puddle_mirror_share)
    return INFINITY;
  const double to_water = (settings_.puddle_top_m - from.y()) / direction.y();
  const SectionPoint up(direction.x(), -direction.y());
  return to_water + section_.ray(from + to_water * direction, up);
}

double SimulatedLidar::measured_m(double range_m) {
  // Every beam draws the same numbers, so that one beam's fate does not change another's noise.
  const double noisy = range_m + settings_.range_sigma_m * random_.normal();
  const bool dropped = random_.uniform() < settings_.dropout_share;
  if (dropped || !(noisy >= settings_.least_range_m && noisy <= settings_.most_range_m)) return 0;
  return settings_.resolution_m > 0 ? settings_.resolution_m * std::round(noisy / settings_.resolution_m)
                                    : noisy;
}

}  // namespace tunnelrig
