// The beams of one sweep, as the matcher's kernels take them.
#pragma once

#include "flight/localisation/beam_kernels.h"
#include "flight/localisation/scan_matcher.h"

#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// Arrays for the beams of a layout; the working memory of one matcher.
class SweptBeams {
 public:
  explicit SweptBeams(const BeamLayout& layout);
  SweptBeams(const SweptBeams&) = delete;  // beams() points into it
  SweptBeams& operator=(const SweptBeams&) = delete;

  const Beams& beams() const { return beams_; }

  /// Takes a scan's ranges, those outside of (least, most) as none. Throws InputError for an empty scan, one
  /// with another number of beams, or NaN. The number of beams with a return.
  int load(const BeamKernels& kernels, const Scan& scan, double least_range_m, double most_range_m);

  /// The beams as they would be from the middle of the sweep to the points that they met. `velocity_m_s` is
  /// that of the LIDAR in its scan plane; a beam shortened to less than `least_range_m` is lost.
  void straighten(const SweepMotion& motion, const Eigen::Vector2d& velocity_m_s, double least_range_m,
                  double most_range_m);

  /// That a beam's direction is off its place in the layout, in beams, at most.
  double bent_beams() const { return bent_beams_; }

 private:
  void point_as_laid_out();

  double step_rad_;
  BeamArray arrays_[10];
  Beams beams_;
  std::vector<Eigen::Vector2f> directions_;  // in the scan plane, as laid out
  double bent_beams_ = 0;
};

}  // namespace tunnelrig
