#include "flight/vehicle/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tunnelrig {
namespace {

double signed_area(const std::vector<Point>& corners) {
  double twice = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Point &a = corners[i], &b = corners[(i + 1) % corners.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return 0.5 * twice;
}

double edge_distance(const Walls::Edge& edge, const Point& p) {
  const double y = p[0] - edge.from[0], z = p[1] - edge.from[1];
  const double along = std::clamp(y * edge.along[0] + z * edge.along[1], 0.0, edge.length);
  return std::hypot(y - along * edge.along[0], z - along * edge.along[1]);
}

}  // namespace

Walls::Walls(std::vector<Point> corners) {
  if (signed_area(corners) < 0) std::reverse(corners.begin(), corners.end());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Point &a = corners[i], &b = corners[(i + 1) % corners.size()];
    const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
    if (length <= 0) continue;
    const Point along = {(b[0] - a[0]) / length, (b[1] - a[1]) / length};
    edges_.push_back({a, along, {-along[1], along[0]}, length});
  }
}

bool Walls::inside(const Point& p) const {
  bool result = false;
  for (const Edge& e : edges_) {
    const Point to = {e.from[0] + e.length * e.along[0], e.from[1] + e.length * e.along[1]};
    if ((e.from[1] > p[1]) == (to[1] > p[1])) continue;
    const double y = e.from[0] + (p[1] - e.from[1]) / (to[1] - e.from[1]) * (to[0] - e.from[0]);
    if (p[0] < y) result = !result;
  }
  return result;
}

double Walls::distance(const Point& p, std::size_t* nearest) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const double d = edge_distance(edges_[i], p);
    if (d >= least) continue;
    least = d;
    if (nearest != nullptr) *nearest = i;
  }
  return least;
}

Touch find_touch(const Walls& walls, const Airframe& frame, double y_m, double z_m, double sin_roll,
                 double cos_roll) {
  Touch deepest;
  const double half_width = 0.5 * frame.width_m, half_height = 0.5 * frame.height_m;
  for (const double side : {-1.0, 1.0}) {
    for (const double level : {-1.0, 1.0}) {
      const double b = side * half_width, h = level * half_height;
      const Point corner = {y_m + b * cos_roll - h * sin_roll, z_m + b * sin_roll + h * cos_roll};
      if (walls.inside(corner)) continue;
      std::size_t edge = 0;
      const double depth = walls.distance(corner, &edge);
      const Point& normal = walls.edges()[edge].inward;
      constexpr double kLevel_m = 1e-4;
      if (deepest.depth_m > 0 && std::abs(depth - deepest.depth_m) < kLevel_m && normal == deepest.normal) {
        // A side that meets the wall flat is hit in its middle, not at whichever corner came first.
        deepest.at = {0.5 * (deepest.at[0] + corner[0]), 0.5 * (deepest.at[1] + corner[1])};
      } else if (depth > deepest.depth_m) {
        deepest = {corner, normal, depth};
      }
    }
  }
  for (const Walls::Edge& edge : walls.edges()) {
    const double dy = edge.from[0] - y_m, dz = edge.from[1] - z_m;
    const double b = dy * cos_roll + dz * sin_roll, h = -dy * sin_roll + dz * cos_roll;
    const double from_side = half_width - std::abs(b), from_level = half_height - std::abs(h);
    const double depth = std::min(from_side, from_level);
    if (depth <= deepest.depth_m) continue;
    const double away_b = from_side < from_level ? (b > 0 ? -1 : 1) : 0;
    const double away_h = from_side < from_level ? 0 : (h > 0 ? -1 : 1);
    deepest = {
        edge.from, {away_b * cos_roll - away_h * sin_roll, away_b * sin_roll + away_h * cos_roll}, depth};
  }
  return deepest;
}

double resolve_touch(RigidState& state, const Airframe& frame, const Touch& touch, const Bounce& bounce) {
  const Point& n = touch.normal;
  const double ry = touch.at[0] - state.position_m[1], rz = touch.at[1] - state.position_m[2];
  state.position_m[1] += touch.depth_m * n[0];
  state.position_m[2] += touch.depth_m * n[1];
  const double roll_rate = state.rate_rad_s[0];
  const double vy = state.velocity_m_s[1] - roll_rate * rz, vz = state.velocity_m_s[2] + roll_rate * ry;
  const double closing = -(vy * n[0] + vz * n[1]);
  if (closing <= 0) return 0;
  const auto impulse_along = [&](const Point& d, double speed_change) {
    const double arm = ry * d[1] - rz * d[0];
    return speed_change / (1 / frame.mass_kg + arm * arm / frame.inertia_kg_m2[0]);
  };
  const auto apply = [&](const Point& d, double impulse) {
    state.velocity_m_s[1] += impulse * d[0] / frame.mass_kg;
    state.velocity_m_s[2] += impulse * d[1] / frame.mass_kg;
    state.rate_rad_s[0] += impulse * (ry * d[1] - rz * d[0]) / frame.inertia_kg_m2[0];
  };
  const double blow = impulse_along(n, (1 + bounce.restitution) * closing);
  const Point tangent = {-n[1], n[0]};
  apply(n, blow);
  // Of the sliding that the blow leaves: rubbing against what was there before it may add energy through the
  // rotation.
  const double sliding = (state.velocity_m_s[1] - state.rate_rad_s[0] * rz) * tangent[0] +
                         (state.velocity_m_s[2] + state.rate_rad_s[0] * ry) * tangent[1];
  const double most = bounce.friction * blow;
  apply(tangent, std::clamp(-impulse_along(tangent, sliding), -most, most));
  return closing;
}

}  // namespace tunnelrig
