#include "flight/localisation/start_search.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tunnelrig {
namespace {

constexpr double kApart_m = 0.15;  // maxima closer than this are one
constexpr std::size_t kMost_peaks = 3;

/// The best of a grid's scores that are apart from each other.
std::vector<Start> apart(const std::vector<Start>& grid, std::size_t most) {
  std::vector<Start> kept;
  while (kept.size() < most) {
    Start best;
    for (const Start& start : grid) {
      if (start.score <= best.score) continue;
      const bool taken = std::any_of(kept.begin(), kept.end(), [&](const Start& other) {
        return (other.position - start.position).norm() < kApart_m;
      });
      if (!taken) best = start;
    }
    if (best.score <= 0) break;
    kept.push_back(best);
  }
  return kept;
}

Found first_of(const std::vector<Start>& grid) {
  const std::vector<Start> two = apart(grid, 2);
  if (two.empty()) return {};
  return {two[0], two.size() < 2 ? 0 : static_cast<double>(two[1].score / two[0].score)};
}

/// How high the best peak outside of `best ± apart` is.
float rival(const HoughColumn& column, const BeamKernels& kernels, double from_m, double to_m,
            double best_m) {
  return std::max(column.height(kernels, from_m, best_m - kApart_m),
                  column.height(kernels, best_m + kApart_m, to_m));
}

}  // namespace

std::vector<SectionPoint> reference_points(const CrossSection& section, const MatcherSettings& settings) {
  std::vector<SectionPoint> points;
  const SectionPoint middle = (section.lowest() + section.highest()) / 2;
  const SectionPoint reach = settings.vantage_spread * (section.highest() - section.lowest()) / 2;
  for (int i = -2; i <= 2; ++i)
    for (int j = -2; j <= 2; ++j) {
      SectionPoint from = middle + reach.cwiseProduct(SectionPoint(i, j) / 2);
      if (settings.vantage_spread == 0) from = {0, 0};
      if (!section.contains(from)) continue;
      for (std::size_t beam = 0; beam < settings.layout.beams; ++beam) {
        const double angle = settings.layout.angle_rad(beam);
        const SectionPoint direction(std::cos(angle), std::sin(angle));
        const double range = section.ray(from, direction);
        if (range < settings.most_range_m) points.emplace_back(from + range * direction);
      }
      if (settings.vantage_spread == 0) return points;
    }
  if (points.empty())
    throw InputError::in("scan matcher", "no wall of the section is in sight of its middle");
  return points;
}

TwoColumnSearch::TwoColumnSearch(const CrossSection& section, std::span<const SectionPoint> reference,
                                 const MatcherSettings& settings)
    : y_(0, reference, section, settings.cell_m, settings.smoothing_m),
      z_(std::numbers::pi / 2, reference, section, settings.cell_m, settings.smoothing_m) {}

void TwoColumnSearch::take(const BeamKernels& kernels, const Beams& beams) {
  y_.correlate(kernels, beams);
  z_.correlate(kernels, beams);
}

Found TwoColumnSearch::find(const BeamKernels& kernels, const SectionBox& box) const {
  const HoughPeak y = y_.highest(kernels, box.lowest.x(), box.highest.x());
  const HoughPeak z = z_.highest(kernels, box.lowest.y(), box.highest.y());
  const float other_y = rival(y_, kernels, box.lowest.x(), box.highest.x(), y.shift_m);
  const float other_z = rival(z_, kernels, box.lowest.y(), box.highest.y(), z.shift_m);
  const auto share = [](float other, float most) {
    return most > 0 ? static_cast<double>(other / most) : 1.0;
  };
  return {{{y.shift_m, z.shift_m}, y.score + z.score},
          std::max(share(other_y, y.score), share(other_z, z.score))};
}

std::vector<Start> TwoColumnSearch::candidates(const BeamKernels& kernels, const SectionBox& box) const {
  std::vector<Start> all;
  for (const HoughPeak& y : y_.peaks(kernels, box.lowest.x(), box.highest.x(), kApart_m, kMost_peaks))
    for (const HoughPeak& z : z_.peaks(kernels, box.lowest.y(), box.highest.y(), kApart_m, kMost_peaks))
      all.push_back({{y.shift_m, z.shift_m}, y.score + z.score});
  std::stable_sort(all.begin(), all.end(), [](const Start& a, const Start& b) { return a.score > b.score; });
  return all;
}

AllDirectionSearch::AllDirectionSearch(const CrossSection& section, std::span<const SectionPoint> reference,
                                       const MatcherSettings& settings)
    : step_m_(std::max(settings.cell_m, 0.75 * settings.smoothing_m)) {
  for (std::size_t k = 0; k < settings.directions; ++k)
    columns_.emplace_back(
        std::numbers::pi * static_cast<double>(k) / static_cast<double>(settings.directions), reference,
        section, settings.cell_m, settings.smoothing_m);
}

void AllDirectionSearch::take(const BeamKernels& kernels, const Beams& beams) {
  for (HoughColumn& column : columns_) column.correlate(kernels, beams);
}

std::vector<Start> AllDirectionSearch::grid(const SectionBox& box) const {
  const Eigen::Vector2d size = box.highest - box.lowest;
  const auto steps_y = static_cast<int>(std::ceil(size.x() / step_m_));
  const auto steps_z = static_cast<int>(std::ceil(size.y() / step_m_));
  std::vector<float> score(static_cast<std::size_t>(steps_z) + 1);
  std::vector<Start> all;
  for (int i = 0; i <= steps_y; ++i) {
    const SectionPoint from = box.lowest + SectionPoint(step_m_ * i, 0);
    std::fill(score.begin(), score.end(), 0.0F);
    for (const HoughColumn& column : columns_) column.add_scores(from, {0, step_m_}, score);
    for (int j = 0; j <= steps_z; ++j)
      all.push_back({from + SectionPoint(0, step_m_ * j), score[static_cast<std::size_t>(j)]});
  }
  return all;
}

std::vector<Start> AllDirectionSearch::candidates(const BeamKernels& /*kernels*/,
                                                  const SectionBox& box) const {
  return apart(grid(box), kMost_peaks * kMost_peaks);
}

Found AllDirectionSearch::find(const BeamKernels& /*kernels*/, const SectionBox& box) const {
  return first_of(grid(box));
}

CircleSearch::CircleSearch(const CrossSection& /*section*/, std::span<const SectionPoint> /*reference*/,
                           const MatcherSettings& settings)
    : cell_m_(std::max(settings.cell_m, settings.smoothing_m)),
      lowest_m_(-settings.circle_diameter_m / 2),
      cells_(static_cast<int>(std::ceil(settings.circle_diameter_m / cell_m_)) + 1) {
  const auto points = static_cast<int>(std::ceil(std::numbers::pi * settings.circle_diameter_m / cell_m_));
  for (int i = 0; i < points; ++i) {
    const double angle = 2 * std::numbers::pi * i / points;
    circle_.emplace_back(settings.circle_diameter_m / 2 * std::cos(angle),
                         settings.circle_diameter_m / 2 * std::sin(angle));
  }
  votes_.resize(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_));
  smoothed_.resize(votes_.size());
}

void CircleSearch::take(const BeamKernels& /*kernels*/, const Beams& beams) {
  constexpr std::size_t kEvery = 3;  // beam: more do not move the maximum by a cell
  std::fill(votes_.begin(), votes_.end(), 0.0F);
  for (std::size_t i = 0; i < beams.count; i += kEvery) {
    if (beams.range[i] <= 0) continue;
    for (const SectionPoint& wall : circle_) {
      const auto y = static_cast<int>(std::floor((wall.x() - beams.y[i] - lowest_m_) / cell_m_));
      const auto z = static_cast<int>(std::floor((wall.y() - beams.z[i] - lowest_m_) / cell_m_));
      if (y >= 0 && y < cells_ && z >= 0 && z < cells_) votes_[index(y, z)] += 1;
    }
  }
  std::fill(smoothed_.begin(), smoothed_.end(), 0.0F);
  for (int y = 1; y + 1 < cells_; ++y)
    for (int z = 1; z + 1 < cells_; ++z)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dz = -1; dz <= 1; ++dz) smoothed_[index(y, z)] += votes_[index(y + dy, z + dz)];
}

std::vector<Start> CircleSearch::grid(const SectionBox& box) const {
  std::vector<Start> all;
  for (int y = 0; y < cells_; ++y)
    for (int z = 0; z < cells_; ++z) {
      const SectionPoint at = SectionPoint(y + 0.5, z + 0.5) * cell_m_ + SectionPoint(lowest_m_, lowest_m_);
      if ((at.array() < box.lowest.array()).any() || (at.array() > box.highest.array()).any()) continue;
      all.push_back({at, smoothed_[index(y, z)]});
    }
  return all;
}

std::vector<Start> CircleSearch::candidates(const BeamKernels& /*kernels*/, const SectionBox& box) const {
  return apart(grid(box), kMost_peaks * kMost_peaks);
}

Found CircleSearch::find(const BeamKernels& /*kernels*/, const SectionBox& box) const {
  return first_of(grid(box));
}

}  // namespace tunnelrig
