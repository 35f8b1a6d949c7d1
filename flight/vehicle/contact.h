// Vehicle against wall, in the plane of the cross-section.
#pragma once

#include "flight/vehicle/airframe.h"
#include "flight/vehicle/rigid_body.h"

#include <array>
#include <vector>

namespace tunnelrig {

using Point = std::array<double, 2>;  // y, z

/// The tunnel's closed outline as contacts need it.
class Walls {
 public:
  /// Corners in order, either way round; at least three. They are inside out for nobody: the sense is found
  /// from the area.
  explicit Walls(std::vector<Point> corners);

  struct Edge {
    Point from, along, inward;  // unit vectors
    double length;
  };

  bool inside(const Point& p) const;

  /// Distance to the nearest wall, and which one it is.
  double distance(const Point& p, std::size_t* nearest = nullptr) const;

  const std::vector<Edge>& edges() const { return edges_; }

 private:
  std::vector<Edge> edges_;
};

/// Where vehicle and wall overlap: the deepest point of it.
struct Touch {
  Point at{}, normal{};  // the normal points away from the wall
  double depth_m = 0;    // 0: no contact
};

/// The vehicle is a rectangle of its width and height, rolled. Corners of the vehicle behind walls and
/// corners of walls inside the vehicle both count.
Touch find_touch(const Walls& walls, const Airframe& frame, double y_m, double z_m, double sin_roll,
                 double cos_roll);

struct Bounce {
  double restitution = 0.4;  // foam guards on wood; assumed
  double friction = 0.3;
};

/// Pushes the vehicle out of the wall and gives it the impulse of the blow (rigid bodies, Newton's
/// restitution, Coulomb's friction at its limit). Returns the normal speed at which it hit, 0 where it was
/// leaving already.
double resolve_touch(RigidState& state, const Airframe& frame, const Touch& touch, const Bounce& bounce);

}  // namespace tunnelrig
