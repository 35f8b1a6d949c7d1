#include "flight/tunnel/cross_section.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tunnelrig {
namespace {

constexpr double kLargest_m = 1000;
constexpr double kShortest_edge_m = 1e-4;

double cross(const SectionPoint& a, const SectionPoint& b) { return a.x() * b.y() - a.y() * b.x(); }

SectionPoint nearest_on_segment(const SectionPoint& from, const SectionPoint& to, const SectionPoint& point) {
  const SectionPoint along = to - from;
  const double length_squared = along.squaredNorm();
  if (length_squared == 0) return from;
  const double t = std::clamp((point - from).dot(along) / length_squared, 0.0, 1.0);
  return from + t * along;
}

double distance_to_segment(const SectionPoint& from, const SectionPoint& to, const SectionPoint& point) {
  return (nearest_on_segment(from, to, point) - point).norm();
}

bool segments_cross(const SectionPoint& a, const SectionPoint& b, const SectionPoint& c,
                    const SectionPoint& d) {
  const double c_side = cross(b - a, c - a);
  const double d_side = cross(b - a, d - a);
  const double a_side = cross(d - c, a - c);
  const double b_side = cross(d - c, b - c);
  return (c_side > 0) != (d_side > 0) && (a_side > 0) != (b_side > 0);
}

/// Also right for segments that touch or lie in one line: one of the four ends is then nearest.
double segment_distance(const SectionPoint& a, const SectionPoint& b, const SectionPoint& c,
                        const SectionPoint& d) {
  if (segments_cross(a, b, c, d)) return 0;
  return std::min({distance_to_segment(c, d, a), distance_to_segment(c, d, b), distance_to_segment(a, b, c),
                   distance_to_segment(a, b, d)});
}

void check_vertices(std::span<const SectionPoint> vertices, const std::string& name) {
  if (vertices.size() < 3 || vertices.size() > CrossSection::kMost_vertices)
    throw InputError::in(name, "{} vertices: a cross-section has 3 to {}", vertices.size(),
                         CrossSection::kMost_vertices);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const SectionPoint& point = vertices[i];
    if (!point.allFinite() || point.cwiseAbs().maxCoeff() > kLargest_m)
      throw InputError::in(name, "vertex {} is ({}, {}) m: coordinates are finite and within {} m", i + 1,
                           point.x(), point.y(), kLargest_m);
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const SectionPoint& point = vertices[i];
    const SectionPoint& next = vertices[(i + 1) % vertices.size()];
    if (!((next - point).norm() >= kShortest_edge_m))
      throw InputError::in(name,
                           "vertices {} and {} are closer than {} mm (do not repeat the first as the last)",
                           i + 1, (i + 1) % vertices.size() + 1, kShortest_edge_m * 1e3);
  }
}

void check_simple(std::span<const SectionPoint> vertices, const std::string& name) {
  const std::size_t count = vertices.size();
  for (std::size_t i = 0; i < count; ++i) {
    const SectionPoint& a = vertices[i];
    const SectionPoint& b = vertices[(i + 1) % count];
    const SectionPoint& after = vertices[(i + 2) % count];
    // a neighbour may only share its corner
    if (count > 3 ? distance_to_segment(a, b, after) < 1e-9 : std::abs(cross(b - a, after - a)) < 1e-9)
      throw InputError::in(name, "the edges at vertex {} fold onto each other", (i + 1) % count + 1);
    for (std::size_t j = i + 2; j < count; ++j) {
      if (i == 0 && j == count - 1) continue;
      if (segment_distance(a, b, vertices[j], vertices[(j + 1) % count]) < 1e-9)
        throw InputError::in(name, "the edges from vertices {} and {} cross or touch", i + 1, j + 1);
    }
  }
}

double signed_area(std::span<const SectionPoint> vertices) {
  double twice = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i)
    twice += cross(vertices[i], vertices[(i + 1) % vertices.size()]);
  return twice / 2;
}

}  // namespace

CrossSection::CrossSection(std::vector<SectionPoint> vertices, const std::string& name)
    : vertices_(std::move(vertices)) {
  check_vertices(vertices_, name);
  check_simple(vertices_, name);
  if (signed_area(vertices_) < 0) std::reverse(vertices_.begin(), vertices_.end());
  box_ = {vertices_.front(), vertices_.front()};
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const SectionPoint& start = vertices_[i];
    const SectionPoint along = vertices_[(i + 1) % vertices_.size()] - start;
    box_.lowest = box_.lowest.cwiseMin(start);
    box_.highest = box_.highest.cwiseMax(start);
    start_y_.push_back(start.x());
    start_z_.push_back(start.y());
    along_y_.push_back(along.x());
    along_z_.push_back(along.y());
  }
}

bool CrossSection::contains(const SectionPoint& point) const {
  bool inside = false;
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const double end_z = start_z_[i] + along_z_[i];
    if ((start_z_[i] > point.y()) == (end_z > point.y())) continue;
    const double t = (point.y() - start_z_[i]) / along_z_[i];
    if (point.x() < start_y_[i] + t * along_y_[i]) inside = !inside;
  }
  return inside;
}

NearestWall CrossSection::nearest_wall(const SectionPoint& point) const {
  NearestWall nearest{.distance_m = std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const SectionPoint on_edge =
        nearest_on_segment(vertices_[i], vertices_[(i + 1) % vertices_.size()], point);
    const double distance = (on_edge - point).norm();
    if (distance >= nearest.distance_m) continue;
    nearest = {distance, i, on_edge};
  }
  return nearest;
}

double CrossSection::clearance(const SectionPoint& point) const {
  const double distance = nearest_wall(point).distance_m;
  return contains(point) ? distance : -distance;
}

double CrossSection::clearance(const SectionPoint& from, const SectionPoint& to) const {
  const double ends = std::min(clearance(from), clearance(to));
  if (ends < 0) return ends;
  double least = ends;
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    least = std::min(least, segment_distance(from, to, vertices_[i], vertices_[(i + 1) % vertices_.size()]));
  return least;
}

double CrossSection::ray(const SectionPoint& from, const SectionPoint& direction) const {
  const double dy = direction.x();
  const double dz = direction.y();
  double nearest = std::numeric_limits<double>::infinity();
  // Written without branches for the vectoriser. Inside a counter-clockwise polygon a ray leaves through
  // edges that run to its left, which is what `facing` > 0 says; it crosses one where 0 <= along <= facing.
  for (std::size_t i = 0; i < start_y_.size(); ++i) {
    const double ry = start_y_[i] - from.x();
    const double rz = start_z_[i] - from.y();
    const double facing = dy * along_z_[i] - dz * along_y_[i];
    const double away = ry * along_z_[i] - rz * along_y_[i];
    const double along = ry * dz - rz * dy;
    const double slack = 1e-12 * facing;  // no ray slips out between two edges
    const bool hit = (facing > 0) & (away >= 0) & (along >= -slack) & (along <= facing + slack);
    const double distance = away / (facing > 0 ? facing : 1.0);
    nearest = hit && distance < nearest ? distance : nearest;
  }
  return nearest;
}

Bar bar(const SectionPoint& middle, double length_m, double roll_rad) {
  const SectionPoint half = length_m / 2 * SectionPoint(std::cos(roll_rad), std::sin(roll_rad));
  return {middle - half, middle + half};
}

}  // namespace tunnelrig
