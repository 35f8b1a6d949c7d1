// Where a match begins: the arg max of the Hough domain, in one of three forms.
#pragma once

#include "flight/localisation/beam_kernels.h"
#include "flight/localisation/hough_column.h"
#include "flight/localisation/scan_matcher.h"

#include <span>
#include <vector>

namespace tunnelrig {

struct Start {
  SectionPoint position{0, 0};
  float score = 0;
};

struct Found {
  Start best;
  double rivalry = 0;  // height of the second highest maximum (of either column) as a share of the highest
};

/// Points of the walls as scans from several places in the section see them. Throws InputError where no wall
/// is in sight of its middle.
std::vector<SectionPoint> reference_points(const CrossSection& section, const MatcherSettings& settings);

// `box`: positions that are searched, m.

/// β = 0° and 90° alone (6.8): y and z are found apart from each other.
class TwoColumnSearch {
 public:
  TwoColumnSearch(const CrossSection& section, std::span<const SectionPoint> reference,
                  const MatcherSettings& settings);
  void take(const BeamKernels& kernels, const Beams& beams);
  Found find(const BeamKernels& kernels, const SectionBox& box) const;
  /// The highest maxima that are apart from each other, best first.
  std::vector<Start> candidates(const BeamKernels& kernels, const SectionBox& box) const;

 private:
  HoughColumn y_, z_;
};

/// Columns over 180°. The sum of all columns' correlations at the shift that a position gives each of them
/// (6.7) is largest at the position; columns without a peak of their own do no harm there, as they would to a
/// fit through their arg max's.
class AllDirectionSearch {
 public:
  AllDirectionSearch(const CrossSection& section, std::span<const SectionPoint> reference,
                     const MatcherSettings& settings);
  void take(const BeamKernels& kernels, const Beams& beams);
  Found find(const BeamKernels& kernels, const SectionBox& box) const;
  std::vector<Start> candidates(const BeamKernels& kernels, const SectionBox& box) const;

 private:
  std::vector<Start> grid(const SectionBox& box) const;

  std::vector<HoughColumn> columns_;
  double step_m_;
};

/// Circle Hough transform (Yuen et al. 1990) with the radius known: every beam votes for the circle of places
/// it could have been sent from.
class CircleSearch {
 public:
  CircleSearch(const CrossSection& section, std::span<const SectionPoint> reference,
               const MatcherSettings& settings);
  void take(const BeamKernels& kernels, const Beams& beams);
  Found find(const BeamKernels& kernels, const SectionBox& box) const;
  std::vector<Start> candidates(const BeamKernels& kernels, const SectionBox& box) const;

 private:
  std::size_t index(int y, int z) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_) + static_cast<std::size_t>(z);
  }
  std::vector<Start> grid(const SectionBox& box) const;

  double cell_m_;
  double lowest_m_;
  int cells_;  // along each axis
  std::vector<SectionPoint> circle_;
  std::vector<float> votes_;
  std::vector<float> smoothed_;
};

}  // namespace tunnelrig
