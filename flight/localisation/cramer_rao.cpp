#include "flight/localisation/cramer_rao.h"

#include <cmath>

#include <Eigen/LU>

namespace tunnelrig {

Eigen::MatrixXd cramer_rao_bound(const CrossSection& section, const BeamLayout& layout,
                                 const SectionPoint& position, const Attitude& attitude, double range_sigma_m,
                                 bool rotation_unknown) {
  constexpr double kStep = 1e-6;
  const Eigen::Matrix2d projection = section_projection(attitude);
  const auto range = [&](const SectionPoint& from, double angle_rad) {
    return section.ray(from, projection * SectionPoint(std::cos(angle_rad), std::sin(angle_rad)));
  };
  const Eigen::Index unknowns = rotation_unknown ? 3 : 2;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  for (std::size_t i = 0; i < layout.beams; ++i) {
    const double angle = layout.angle_rad(i);
    const auto slope = [&](const SectionPoint& move, double turn) {
      return (range(position + kStep * move, angle + kStep * turn) -
              range(position - kStep * move, angle - kStep * turn)) /
             (2 * kStep);
    };
    Eigen::VectorXd gradient(unknowns);
    gradient(0) = slope({1, 0}, 0);
    gradient(1) = slope({0, 1}, 0);
    if (rotation_unknown) gradient(2) = slope({0, 0}, 1);
    information += gradient * gradient.transpose();
  }
  return range_sigma_m * range_sigma_m * information.inverse();
}

}  // namespace tunnelrig
