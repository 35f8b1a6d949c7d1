#include "datasets/published_field.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

double bell(double x, double centre, double width) {
  const double u = (x - centre) / width;
  return std::exp(-u * u);
}

double smoothstep(double x) { return x * x * (3 - 2 * x); }

}  // namespace

double published_thrust_change(double y_norm, double z_norm) {
  const double y = std::min(std::abs(y_norm), 1.0);
  const double z = z_norm;
  const double wall = smoothstep(y);
  const double centre_line = 0.028 * z + 0.010 * z * z;  // claim 1
  const double ceiling_bump =
      bell(y, 0.65, 0.35) - bell(0, 0.65, 0.35);  // claim 2: largest near H3, less at H5
  const double ceiling = 0.035 * ceiling_bump * std::exp((z - 0.95) / 0.35);
  const double lift = 0.006 * wall;                                // claim 4: higher near the wall
  const double ground_dip = -0.024 * wall * bell(z, -0.62, 0.30);  // claim 3: falls, rises again at V-3
  return centre_line + ceiling + lift + ground_dip;                // every term vanishes at the origin
}

double published_uneven_thrust(double y_norm, double z_norm) {
  const double y = std::min(std::abs(y_norm), 1.0);
  const double z = z_norm;
  const double below = 0.034 * bell(z, -0.50, 0.22);  // claim 6: largest near V-1 to V-2
  const double near_ceiling = 0.010 * bell(z, 0.95, 0.50);
  const double near_ground = 0.008 * bell(z, -0.95, 0.30);
  const double notch =
      1 - 0.75 * bell(y, 0.80, 0.15) * bell(z, -0.95, 0.20);  // claim 6: close to zero at H4V-3
  const double magnitude = std::pow(y, 1.2) * (0.006 + below + near_ceiling + near_ground) * notch;
  return y_norm > 0 ? -magnitude : magnitude;  // claims 5 and 7
}

double published_ground_ratio(double distance_R) {
  // A rise close to the ground and the local minimum that the thesis marks in 4.21.
  return 1 + 0.09 * std::exp(-(distance_R - 0.5) / 0.45) - 0.018 * bell(distance_R, 2.0, 0.9);
}

double published_ceiling_ratio(double distance_R) {
  return 1.01 + 0.10 * std::exp(-(distance_R - 0.5) / 0.7);
}

std::array<double, 4> rotor_shares(double uneven) {
  const double right = (1 + uneven) / 4, left = (1 - uneven) / 4;
  return {right, left, left, right};
}

}  // namespace tunnelrig
