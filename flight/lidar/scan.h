// One sweep of a LIDAR, as the matcher takes it, and the attitude that goes with it.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// Roll, pitch and yaw in rad, about x, y and z of a right-handed frame with y to the right and z up, so that
/// x points out of the tunnel's cross-section towards whoever looks along −x: a positive roll lifts the right
/// side.
struct Attitude {
  double roll_rad = 0;
  double pitch_rad = 0;
  double yaw_rad = 0;
};

/// Body to world, R = Rz(yaw) Ry(pitch) Rx(roll): (3.4) with its second column corrected.
Eigen::Matrix3d rotation(const Attitude& attitude);

/// How a scan plane (the body's y-z plane) is seen in the cross-section: y and z rows and columns of R. A
/// body point (y, z) of the scan plane lies at projection · (y, z) from the vehicle, whatever its pitch and
/// yaw do along the tunnel.
Eigen::Matrix2d section_projection(const Attitude& attitude);

/// Where the beams of a LIDAR point, in the scan plane, from y towards z.
struct BeamLayout {
  std::size_t beams = 541;
  double first_rad = -0.785398163397448310;  // UST-10LX, blind spot downwards: −45° … 225°
  double step_rad = 0.00872664625997164788;  // 0.5°

  double angle_rad(std::size_t beam) const { return first_rad + static_cast<double>(beam) * step_rad; }
};

/// Ranges in m, one for each beam. 0, or any range outside the LIDAR's, is a beam without a return; NaN is an
/// error.
struct Scan {
  std::vector<float> range_m;
};

}  // namespace tunnelrig
