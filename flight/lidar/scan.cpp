#include "flight/lidar/scan.h"

#include <cmath>

namespace tunnelrig {

Eigen::Matrix3d rotation(const Attitude& attitude) {
  const double cr = std::cos(attitude.roll_rad);
  const double sr = std::sin(attitude.roll_rad);
  const double cp = std::cos(attitude.pitch_rad);
  const double sp = std::sin(attitude.pitch_rad);
  const double cy = std::cos(attitude.yaw_rad);
  const double sy = std::sin(attitude.yaw_rad);
  Eigen::Matrix3d r;
  r << cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy,  //
      cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy,   //
      -sp, sr * cp, cr * cp;
  return r;
}

Eigen::Matrix2d section_projection(const Attitude& attitude) {
  return rotation(attitude).bottomRightCorner<2, 2>();
}

}  // namespace tunnelrig
