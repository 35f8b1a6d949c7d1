#include "daq/clock_fit.h"

#include <cmath>

namespace tunnelrig {
namespace {

constexpr double kBlock_s = 0.5;
constexpr double kShortest_s = 10;
constexpr double kSigmas95 = 1.96;

}  // namespace

void ClockFit::add(std::uint32_t boot_id, std::uint64_t ticks, std::uint32_t tick_hz,
                   std::uint32_t ticks_per_frame, double time_s) {
  if (tick_hz == 0 || ticks_per_frame == 0) return;
  if (!started_ || boot_id != boot_id_ || tick_hz != tick_hz_ || ticks_per_frame != ticks_per_frame_ ||
      ticks < first_ticks_) {
    *this = ClockFit();
    started_ = true;
    boot_id_ = boot_id;
    tick_hz_ = tick_hz;
    ticks_per_frame_ = ticks_per_frame;
    first_ticks_ = ticks;
    first_time_s_ = time_s;
  }
  const double board_s = static_cast<double>(ticks - first_ticks_) / tick_hz;
  const Point point{board_s, time_s - first_time_s_ - board_s};
  const auto block = static_cast<std::int64_t>(board_s / kBlock_s);
  if (block > block_) {
    block_ = block;
    points_.push_back(point);
  } else if (block == block_ && point.late_s < points_.back().late_s) {
    points_.back() = point;
  }
}

std::optional<ClockEstimate> ClockFit::estimate() const {
  const auto n = static_cast<double>(points_.size());
  if (points_.empty() || points_.back().board_s < kShortest_s || n < 8) return {};
  if (points_.back().late_s + points_.back().board_s <= 0)
    return {};  // the host's clock stood still: a replay
  // Orthogonal polynomials of x = board_s - mean: 1, x, q = x^2 - a x - m2.
  double mean_x = 0, mean_y = 0;
  for (const Point& p : points_) {
    mean_x += p.board_s / n;
    mean_y += p.late_s / n;
  }
  double m2 = 0, m3 = 0, xy = 0;
  for (const Point& p : points_) {
    const double x = p.board_s - mean_x;
    m2 += x * x / n;
    m3 += x * x * x / n;
    xy += x * (p.late_s - mean_y);
  }
  const double a = m3 / m2, slope = xy / (n * m2);
  double qq = 0, qy = 0;
  for (const Point& p : points_) {
    const double x = p.board_s - mean_x, q = x * x - a * x - m2;
    qq += q * q;
    qy += q * (p.late_s - mean_y);
  }
  const double curvature = qy / qq;
  double line_rest = 0, parabola_rest = 0;
  for (const Point& p : points_) {
    const double x = p.board_s - mean_x, q = x * x - a * x - m2;
    const double rest = p.late_s - mean_y - slope * x;
    line_rest += rest * rest;
    parabola_rest += (rest - curvature * q) * (rest - curvature * q);
  }
  const double nominal_hz = static_cast<double>(tick_hz_) / ticks_per_frame_;
  const double slope_sd = std::sqrt(line_rest / (n - 2) / (n * m2));
  const double curvature_sd = std::sqrt(parabola_rest / (n - 3) / qq);
  // A second of the board is 1 + slope seconds of the host; the rate changes by -2 curvature per second.
  const double ppm_h = 2 * 1e6 * 3600;
  return ClockEstimate{.rate_hz = nominal_hz / (1 + slope),
                       .rate_interval_hz = kSigmas95 * nominal_hz * slope_sd,
                       .drift_ppm_h = -ppm_h * curvature,
                       .drift_interval_ppm_h = kSigmas95 * ppm_h * curvature_sd,
                       .span_s = points_.back().board_s};
}

}  // namespace tunnelrig
