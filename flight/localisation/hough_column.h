// One column of the Hough domain: the histogram of a scan in one direction, and its correlation with the
// reference's.
#pragma once

#include "flight/localisation/beam_kernels.h"
#include "flight/tunnel/cross_section.h"

#include <cstdint>
#include <span>
#include <vector>

namespace tunnelrig {

struct HoughPeak {
  double shift_m = 0;  // position along the column's direction, interpolated between cells
  float score = 0;
};

/// The reference's column is kept as its highest cells alone, the walls: what is spread over many cells moves
/// the maximum of the correlation (6.9) by little and would cost most of its time.
class HoughColumn {
 public:
  /// `reference` are points of the section's walls as scans see them, in the world frame.
  HoughColumn(double direction_rad, std::span<const SectionPoint> reference, const CrossSection& section,
              double cell_m, double smoothing_m);

  /// Fills the scores for a scan whose beams have been projected.
  void correlate(const BeamKernels& kernels, const Beams& beams);

  float height(const BeamKernels& kernels, double from_m, double to_m) const;  // the highest score
  HoughPeak highest(const BeamKernels& kernels, double from_m, double to_m) const;

  /// The highest scores between two shifts, at least `apart_m` from each other, best first, at most `most`.
  std::vector<HoughPeak> peaks(const BeamKernels& kernels, double from_m, double to_m, double apart_m,
                               std::size_t most) const;

  /// Adds the score of the nearest cell at `from`, `from` + step, … to `into`.
  void add_scores(const SectionPoint& from, const SectionPoint& step, std::span<float> into) const;

  double lowest_m() const { return first_shift_m_; }
  double highest_m() const { return first_shift_m_ + cell_m_ * static_cast<double>(score_.size() - 1); }

 private:
  std::size_t cell_of(double shift_m) const;
  HoughPeak interpolated(std::size_t at) const;
  void keep_highest_cells(std::span<const SectionPoint> reference);

  double cosine_;
  double sine_;
  double cell_m_;
  double first_shift_m_ = 0;         // of score_
  double offset_ = 0;                // cell of a scan point at ρ = 0
  std::vector<std::int32_t> start_;  // cells of the reference, as BeamKernels::correlate takes them
  std::vector<float> weight_;
  std::vector<float> taps_;
  std::vector<std::int32_t> cell_;        // of each beam
  std::vector<std::uint16_t> histogram_;  // two, of even and of odd beams: neighbours fall into one cell
  std::vector<float> raw_;
  std::vector<float> score_;
};

}  // namespace tunnelrig
