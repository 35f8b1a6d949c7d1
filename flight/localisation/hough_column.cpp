#include "flight/localisation/hough_column.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

constexpr float kLeast_height = 0.15F;  // of the highest cell
constexpr std::size_t kMost_cells = 48;

}  // namespace

HoughColumn::HoughColumn(double direction_rad, std::span<const SectionPoint> reference,
                         const CrossSection& section, double cell_m, double smoothing_m)
    : cosine_(std::cos(direction_rad)), sine_(std::sin(direction_rad)), cell_m_(cell_m) {
  double lowest = INFINITY;
  double highest = -INFINITY;
  for (const SectionPoint& vertex : section.vertices()) {
    const double rho = cosine_ * vertex.x() + sine_ * vertex.y();
    lowest = std::min(lowest, rho);
    highest = std::max(highest, rho);
  }
  const auto half = static_cast<std::size_t>(std::lround(smoothing_m / cell_m));
  for (std::size_t j = 0; j <= 2 * half; ++j) {
    const double from_middle = std::abs(static_cast<double>(j) - static_cast<double>(half));
    taps_.push_back(static_cast<float>(1 - from_middle / static_cast<double>(half + 1)));
  }
  const auto shifts = static_cast<std::size_t>(std::ceil((highest - lowest) / cell_m)) + 1;
  first_shift_m_ = lowest;
  score_.resize(shifts);
  raw_.resize(shifts + 2 * half);
  // From every shift that is scored, every cell of the reference falls between the two outermost cells, which
  // take what lies outside (the range gate).
  offset_ = std::ceil((highest - lowest) / cell_m) + static_cast<double>(half) + 3;
  histogram_.resize(2 * static_cast<std::size_t>(2 * offset_ + 1));
  keep_highest_cells(reference);
}

void HoughColumn::keep_highest_cells(std::span<const SectionPoint> reference) {
  // As seen from the first of raw_'s shifts
  const double first = first_shift_m_ - cell_m_ * 0.5 * static_cast<double>(taps_.size() - 1);
  std::vector<float> count(histogram_.size() / 2);
  for (const SectionPoint& point : reference) {
    const double at = (cosine_ * point.x() + sine_ * point.y() - first) / cell_m_ + offset_;
    count[static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(count.size() - 1)))] += 1;
  }
  std::vector<std::int32_t> order(count.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::int32_t>(i);
  const auto value = [&](std::int32_t cell) { return count[static_cast<std::size_t>(cell)]; };
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return value(a) > value(b); });
  const float most = value(order.front());
  for (const std::int32_t cell : order) {
    if (start_.size() == kMost_cells || value(cell) < kLeast_height * most || value(cell) == 0) break;
    start_.push_back(cell);
    weight_.push_back(value(cell) / static_cast<float>(reference.size()));
  }
}

void HoughColumn::correlate(const BeamKernels& kernels, const Beams& beams) {
  const std::size_t cells = histogram_.size() / 2;
  cell_.resize(beams.padded);
  kernels.cells(beams, static_cast<float>(cosine_ / cell_m_), static_cast<float>(sine_ / cell_m_),
                static_cast<float>(offset_), static_cast<float>(cells - 1), cell_.data());
  std::fill(histogram_.begin(), histogram_.end(), std::uint16_t{0});
  std::uint16_t* even = histogram_.data();
  std::uint16_t* odd = even + cells;
  for (std::size_t i = 0; i < beams.padded; i += 2) {
    ++even[cell_[i]];
    ++odd[cell_[i + 1]];
  }
  for (std::size_t i = 0; i < cells; ++i) even[i] = static_cast<std::uint16_t>(even[i] + odd[i]);
  even[0] = even[cells - 1] = 0;
  kernels.correlate(even, start_.data(), weight_.data(), start_.size(), raw_.data(), raw_.size());
  kernels.smooth(raw_.data(), taps_.data(), taps_.size(), score_.data(), score_.size());
}

std::size_t HoughColumn::cell_of(double shift_m) const {
  const double at = std::round((shift_m - first_shift_m_) / cell_m_);
  return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(score_.size() - 1)));
}

void HoughColumn::add_scores(const SectionPoint& from, const SectionPoint& step,
                             std::span<float> into) const {
  const auto first =
      static_cast<float>((cosine_ * from.x() + sine_ * from.y() - first_shift_m_) / cell_m_ + 0.5);
  const auto next = static_cast<float>((cosine_ * step.x() + sine_ * step.y()) / cell_m_);
  const auto last = static_cast<float>(score_.size() - 1);
  for (std::size_t i = 0; i < into.size(); ++i) {
    const float at = std::clamp(first + next * static_cast<float>(i), 0.0F, last);
    into[i] += score_[static_cast<std::size_t>(static_cast<std::int32_t>(at))];
  }
}

/// A parabola through the highest cell and its neighbours.
HoughPeak HoughColumn::interpolated(std::size_t at) const {
  double fraction = 0;
  if (at > 0 && at + 1 < score_.size()) {
    const double before = score_[at - 1];
    const double after = score_[at + 1];
    const double bend = before - 2.0 * score_[at] + after;
    if (bend < 0) fraction = std::clamp(0.5 * (before - after) / bend, -0.5, 0.5);
  }
  return {first_shift_m_ + cell_m_ * (static_cast<double>(at) + fraction), score_[at]};
}

float HoughColumn::height(const BeamKernels& kernels, double from_m, double to_m) const {
  if (!(from_m <= to_m)) return 0;
  const std::size_t first = cell_of(from_m);
  return kernels.maximum(score_.data() + first, cell_of(to_m) + 1 - first);
}

HoughPeak HoughColumn::highest(const BeamKernels& kernels, double from_m, double to_m) const {
  if (!(from_m <= to_m)) return {};
  const auto from = score_.begin() + static_cast<std::ptrdiff_t>(cell_of(from_m));
  const auto at = std::find(from, score_.end() - 1, height(kernels, from_m, to_m));
  return interpolated(static_cast<std::size_t>(at - score_.begin()));
}

std::vector<HoughPeak> HoughColumn::peaks(const BeamKernels& kernels, double from_m, double to_m,
                                          double apart_m, std::size_t most) const {
  std::vector<HoughPeak> found;
  // Intervals between what has been found
  std::vector<std::pair<double, double>> open{{std::max(from_m, lowest_m()), std::min(to_m, highest_m())}};
  while (found.size() < most) {
    HoughPeak best;
    std::size_t in = 0;
    for (std::size_t i = 0; i < open.size(); ++i) {
      const HoughPeak peak = highest(kernels, open[i].first, open[i].second);
      if (peak.score <= best.score) continue;
      best = peak;
      in = i;
    }
    if (best.score <= 0) break;
    found.push_back(best);
    open.emplace_back(best.shift_m + apart_m, open[in].second);
    open[in].second = best.shift_m - apart_m;
  }
  return found;
}

}  // namespace tunnelrig
