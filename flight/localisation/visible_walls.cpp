#include "flight/localisation/visible_walls.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

namespace tunnelrig {
namespace {

constexpr double kSlack_beams = 1e-6;  // no beam falls between two edges
constexpr double kTouching_m = 1e-6;

}  // namespace

VisibleWalls::VisibleWalls(const CrossSection& section, const BeamLayout& layout)
    : layout_(layout),
      full_turn_(2 * std::numbers::pi / layout.step_rad),
      vertices_(section.vertices().begin(), section.vertices().end()),
      seen_at_(vertices_.size()) {
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const SectionPoint along = (vertices_[(i + 1) % vertices_.size()] - vertices_[i]).normalized();
    const SectionPoint normal(along.y(), -along.x());
    edges_.push_back({normal.x(), normal.y(), normal.dot(vertices_[i])});
  }
}

void VisibleWalls::look(const BeamKernels& kernels, const Beams& beams, const Eigen::Matrix2d& projection,
                        const SectionPoint& from, double bent_beams) {
  std::fill_n(beams.inverse, beams.padded, 0.0F);

  // Seen from the scan plane, where the beams are evenly spread, the section is an affine picture of itself.
  const Eigen::Matrix2d to_plane = projection.inverse();
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const SectionPoint at = to_plane * (vertices_[i] - from);
    const double beam = (std::atan2(at.y(), at.x()) - layout_.first_rad) / layout_.step_rad;
    seen_at_[i] = beam - full_turn_ * std::floor(beam / full_turn_);
  }
  const double slack = bent_beams + kSlack_beams;
  const auto see = [&](double first, double last, float wall_y, float wall_z) {
    const double most = static_cast<double>(beams.count);
    const double start = std::clamp(std::ceil(first - slack), 0.0, most);
    const double end = std::clamp(std::floor(last + slack) + 1, 0.0, most);
    if (start < end)
      kernels.see(beams, static_cast<std::size_t>(start), static_cast<std::size_t>(end), wall_y, wall_z);
  };
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const Edge& edge = edges_[i];
    const double distance = edge.offset - edge.normal_y * from.x() - edge.normal_z * from.y();
    if (distance < kTouching_m) continue;  // its back, or edge-on
    const auto wall_y = static_cast<float>(edge.normal_y / distance);
    const auto wall_z = static_cast<float>(edge.normal_z / distance);
    const double first = seen_at_[i];
    double last = seen_at_[(i + 1) % edges_.size()];
    if (last < first) last += full_turn_;
    see(first, last, wall_y, wall_z);
    see(first - full_turn_, last - full_turn_, wall_y, wall_z);
  }
}

}  // namespace tunnelrig
