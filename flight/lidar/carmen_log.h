// Reader of LIDAR logs in CARMEN's text format: published scans, which the tests hold the matcher against. No
// verb reads one.
#pragma once

#include "flight/lidar/scan.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// A planar pose of a robot: x forwards and y to the left where theta_rad is 0.
struct PlanarPose {
  double x_m = 0;
  double y_m = 0;
  double theta_rad = 0;
};

/// One line "FLASER n range… x y theta odom_x odom_y odom_theta ipc_time host logger_time".
struct CarmenScan {
  Scan scan;        // counter-clockwise over 180°, the middle straight ahead
  PlanarPose pose;  // of the LIDAR, corrected where the log is
  PlanarPose odometry;
  double time_s = 0;
  int line = 0;
};

enum class LogTime { kForwards, kAsLogged };

/// The FLASER lines of a log; comments, other messages and empty lines are passed over. Throws InputError
/// naming file and line for a FLASER line that is cut short or holds something else than numbers, and for one
/// that is older than the one before (some published logs have such lines: kAsLogged takes them).
std::vector<CarmenScan> parse_carmen_log(std::string_view text, const std::string& file,
                                         LogTime time = LogTime::kForwards);

/// Reads a plain log, not a compressed one.
std::vector<CarmenScan> read_carmen_log(const std::filesystem::path& path, LogTime time = LogTime::kForwards);

/// Beams of a CARMEN scan of n ranges: 180° in n steps, half a step from either end where n is even (SICK:
/// 180 or 360 beams), from end to end where it is odd (181, 361). Angles are from the right, as BeamLayout's
/// are.
BeamLayout carmen_layout(std::size_t beams);

}  // namespace tunnelrig
