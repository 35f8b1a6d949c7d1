#include "flight/lidar/simulated_lidar.h"

#include "datasets/error.h"

#include <cmath>

namespace tunnelrig {
namespace {

void check(const char* name, double value, double lowest, double highest) {
  if (!(value >= lowest && value <= highest))
    throw InputError::in("LIDAR", "{} is {}: it lies between {} and {}", name, value, lowest, highest);
}

bool same(const Attitude& a, const Attitude& b) {
  return a.roll_rad == b.roll_rad && a.pitch_rad == b.pitch_rad && a.yaw_rad == b.yaw_rad;
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

Scan SimulatedLidar::sweep(const LidarPose& start, const LidarPose& end) {
  Scan scan;
  scan.range_m.reserve(directions_.size());
  const bool turning = !same(start.attitude, end.attitude);
  // Linear between the ends: a turn of a degree in the sweep bends the beams by less than 0.1 mrad more.
  const Eigen::Matrix2d first = section_projection(start.attitude);
  const Eigen::Matrix2d change = turning ? Eigen::Matrix2d(section_projection(end.attitude) - first)
                                         : Eigen::Matrix2d(Eigen::Matrix2d::Zero());
  for (std::size_t i = 0; i < directions_.size(); ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(directions_.size() - 1);
    const SectionPoint from = start.position + t * (end.position - start.position);
    scan.range_m.push_back(
        static_cast<float>(measured_m(range_m(from, (first + t * change) * directions_[i]))));
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
