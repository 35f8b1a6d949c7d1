#include "flight/localisation/swept_beams.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

SweptBeams::SweptBeams(const BeamLayout& layout) : step_rad_(layout.step_rad) {
  float** const into[] = {&beams_.cosine, &beams_.sine, &beams_.range,  &beams_.along_y, &beams_.along_z,
                          &beams_.y,      &beams_.z,    &beams_.wall_y, &beams_.wall_z,  &beams_.inverse};
  for (std::size_t i = 0; i < std::size(arrays_); ++i) {
    arrays_[i].resize(layout.beams);
    *into[i] = arrays_[i].data();
  }
  beams_.count = layout.beams;
  beams_.padded = arrays_[0].padded();
  for (std::size_t i = 0; i < beams_.count; ++i) {
    const double angle = layout.angle_rad(i);
    directions_.emplace_back(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)));
  }
  point_as_laid_out();
}

void SweptBeams::point_as_laid_out() {
  for (std::size_t i = 0; i < beams_.count; ++i) {
    beams_.cosine[i] = directions_[i].x();
    beams_.sine[i] = directions_[i].y();
  }
  bent_beams_ = 0;
}

int SweptBeams::load(const BeamKernels& kernels, const Scan& scan, double least_range_m,
                     double most_range_m) {
  if (scan.range_m.empty()) throw InputError::in("scan", "it is empty");
  if (scan.range_m.size() != beams_.count)
    throw InputError::in("scan", "{} beams: the matcher was set up for {}", scan.range_m.size(),
                         beams_.count);
  const int returned = kernels.load(scan.range_m.data(), beams_, static_cast<float>(least_range_m),
                                    static_cast<float>(most_range_m));
  if (returned < 0) {
    const auto wrong = std::find_if(scan.range_m.begin(), scan.range_m.end(), [](float r) { return r != r; });
    throw InputError::in("scan", "beam {} is not a number", wrong - scan.range_m.begin());
  }
  return returned;
}

void SweptBeams::straighten(const SweepMotion& motion, const Eigen::Vector2d& velocity_m_s,
                            double least_range_m, double most_range_m) {
  if (bent_beams_ > 0) point_as_laid_out();
  const Eigen::Vector2f travel = (velocity_m_s * motion.sweep_s).cast<float>();
  const auto turn_rad = static_cast<float>(motion.roll_rate_rad_s * motion.sweep_s);
  const auto bend_rad =
      static_cast<float>(0.5 * motion.roll_acceleration_rad_s2 * motion.sweep_s * motion.sweep_s);
  if (travel.isZero(0) && turn_rad == 0 && bend_rad == 0) return;
  float nearest = static_cast<float>(most_range_m);
  const float each = 1 / static_cast<float>(beams_.count - 1);
  for (std::size_t i = 0; i < beams_.count; ++i) {
    if (!(beams_.range[i] > 0)) continue;
    nearest = std::min(nearest, beams_.range[i]);
    const float at = each * static_cast<float>(i) - 0.5F;
    // sin and cos of so small an angle
    const float sine = at * (turn_rad + at * bend_rad), cosine = 1 - 0.5F * sine * sine;
    const Eigen::Vector2f& d = directions_[i];
    const Eigen::Vector2f end =
        beams_.range[i] * Eigen::Vector2f(cosine * d.x() - sine * d.y(), sine * d.x() + cosine * d.y()) +
        at * travel;
    const float range = end.norm();
    // Nothing is left of a beam by a motion that cannot be.
    const bool real = range >= static_cast<float>(least_range_m) && std::isfinite(range);
    beams_.range[i] = real ? range : 0;
    if (!real) continue;
    beams_.cosine[i] = end.x() / range;
    beams_.sine[i] = end.y() / range;
  }
  bent_beams_ = 0.5 * static_cast<double>(std::abs(turn_rad) + std::abs(bend_rad) + travel.norm() / nearest) /
                step_rad_;
}

}  // namespace tunnelrig
