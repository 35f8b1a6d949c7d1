// The cross-section of a tunnel: a closed polygon, and the geometry that flight asks of it.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// A point of the cross-section: y to the right, z up, m, origin at the centre of the bounding box of the
/// section without its small features. A direction or a size in the same axes is one too.
using SectionPoint = Eigen::Vector2d;

/// A rectangle by its corners, m.
struct SectionBox {
  SectionPoint lowest{0, 0}, highest{0, 0};

  double width_m() const { return highest.x() - lowest.x(); }
  double height_m() const { return highest.y() - lowest.y(); }
  SectionPoint middle() const { return (lowest + highest) / 2; }
};

/// Distance to the wall that is nearest to a point.
struct NearestWall {
  double distance_m = 0;  // always positive
  std::size_t edge = 0;   // index of the edge, which runs from vertex `edge` to the next
  SectionPoint point{0, 0};
};

/// A simple polygon, its vertices counter-clockwise. Immutable and safe to share among threads.
class CrossSection {
 public:
  static constexpr std::size_t kMost_vertices = 1000;

  /// Takes the vertices as they are, in either direction. Throws InputError, with `name` in front, for fewer
  /// than three or more than kMost_vertices, a coordinate that is not finite or beyond 1 km, an edge shorter
  /// than 0.1 mm, or edges that cross or touch.
  explicit CrossSection(std::vector<SectionPoint> vertices, const std::string& name = "cross-section");

  std::span<const SectionPoint> vertices() const { return vertices_; }
  const SectionBox& box() const { return box_; }
  SectionPoint lowest() const { return box_.lowest; }
  SectionPoint highest() const { return box_.highest; }
  double width_m() const { return box_.width_m(); }
  double height_m() const { return box_.height_m(); }

  bool contains(const SectionPoint& point) const;

  NearestWall nearest_wall(const SectionPoint& point) const;

  /// Distance from a point to the wall, negative where the point is not in the tunnel.
  double clearance(const SectionPoint& point) const;

  /// Distance from a segment to the wall; where it reaches into the wall, minus the depth of the deeper end
  /// (0 where only its middle does).
  double clearance(const SectionPoint& from, const SectionPoint& to) const;

  /// Distance from a point in the tunnel along a direction to the wall, in lengths of the direction, which
  /// need not be of unit length. Infinity where nothing is met: the direction is zero, or the point outside.
  double ray(const SectionPoint& from, const SectionPoint& direction) const;

 private:
  std::vector<SectionPoint> vertices_;
  SectionBox box_;
  // One value per edge each, side by side, so that a ray meets several edges at once.
  std::vector<double> start_y_, start_z_, along_y_, along_z_;
};

/// Ends of a bar of the given length (the vehicle's tip to tip) about its middle, rolled by an angle from y
/// towards z: first the left end, then the right one.
struct Bar {
  SectionPoint left;
  SectionPoint right;
};
Bar bar(const SectionPoint& middle, double length_m, double roll_rad);

}  // namespace tunnelrig
