// SIMULATED LIDAR: sweeps of a UST-10LX in a tunnel whose cross-section does not change along it. It shares
// no code with the matcher.
#pragma once

#include "flight/lidar/scan.h"
#include "flight/tunnel/cross_section.h"
#include "flight/vehicle/random.h"

#include <array>
#include <cstdint>
#include <span>

namespace tunnelrig {

/// Where the LIDAR is while one beam is measured.
struct LidarPose {
  SectionPoint position{0, 0};
  Attitude attitude;
};

struct LidarSettings {
  BeamLayout layout;
  double rate_hz = 40;
  /// Time from the first beam to the last: the mirror turns once per period, 270° of it measuring.
  double sweep_s = 0.01875;
  double range_sigma_m = 0.010;  // the maker states ±40 mm
  double least_range_m = 0.06;
  double most_range_m = 10;
  double resolution_m = 0.001;  // the sensor reports whole millimetres; 0 leaves the ranges as they are
  double dropout_share = 0;     // of the beams, independently
  /// Water on the floor: below this height (world z, m) a share of the beams is mirrored and returns from
  /// where the mirrored path meets the wall, the others get no return from the water.
  double puddle_top_m = -1e9;
  double puddle_mirror_share = 0.5;
};

/// Throws InputError for settings out of range, naming the value and the rule.
class SimulatedLidar {
 public:
  SimulatedLidar(const CrossSection& section, const LidarSettings& settings, std::uint64_t seed);

  /// A sweep during which the LIDAR goes through these poses, two or more, at equal intervals of time. Ranges
  /// without a return are 0, as are those of a LIDAR outside the tunnel.
  Scan sweep(std::span<const LidarPose> path);

  /// In steady motion.
  Scan sweep(const LidarPose& start, const LidarPose& end) { return sweep(std::array{start, end}); }

  /// At rest.
  Scan sweep(const LidarPose& pose) { return sweep(pose, pose); }

  const LidarSettings& settings() const { return settings_; }

 private:
  double measured_m(double range_m);
  double range_m(const SectionPoint& from, const SectionPoint& direction);

  CrossSection section_;
  LidarSettings settings_;
  std::vector<Eigen::Vector2d> directions_;
  Random random_;
};

}  // namespace tunnelrig
