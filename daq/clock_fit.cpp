#include "daq/clock_fit.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

constexpr double kBlock_s = 0.5;
constexpr double kShortest_s = 10;
constexpr double kLongest_s =
    1e9;  // a board that counts further than 30 years from its first packet is wrong
constexpr double kSigmas95 = 1.96;

/// Far above the lower edge: sixteen times the lower quartile of the heights above it. Of exponential delays
/// a hundredth lies there, of a clock whose drift bends the line upwards nothing.
constexpr double kFar = 16;
constexpr double kLeastSpread_s = 1e-6;

constexpr double kWidest =
    1e-3;  // an interval of the rate as wide as what `doctor` complains of says nothing

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
  if (board_s > kLongest_s) return;
  const Point point{board_s, time_s - first_time_s_ - board_s};
  const auto block = static_cast<std::int64_t>(board_s / kBlock_s);
  if (block > block_) {
    block_ = block;
    points_.push_back(point);
  } else if (block == block_ && point.late_s < points_.back().late_s) {
    points_.back() = point;
  }
}

/// The points that do not lie far above the edge of their lower hull that spans the middle: a line with no
/// point below it, whatever came late.
std::vector<ClockFit::Point> ClockFit::on_time() const {
  const auto slope = [](const Point& a, const Point& b) {
    return (b.late_s - a.late_s) / (b.board_s - a.board_s);
  };
  std::vector<Point> hull;
  for (const Point& p : points_) {
    while (hull.size() > 1 && slope(hull[hull.size() - 2], p) <= slope(hull[hull.size() - 2], hull.back()))
      hull.pop_back();
    hull.push_back(p);
  }
  const double middle_s = (points_.front().board_s + points_.back().board_s) / 2;
  const auto right = std::find_if(hull.begin() + 1, hull.end() - 1,
                                  [middle_s](const Point& p) { return p.board_s > middle_s; });
  const Point from = *(right - 1);
  const double edge = slope(from, *right);
  const auto height_s = [&](const Point& p) {
    return p.late_s - from.late_s - edge * (p.board_s - from.board_s);
  };
  std::vector<double> heights_s;
  for (const Point& p : points_) heights_s.push_back(height_s(p));
  const auto quartile = heights_s.begin() + static_cast<std::ptrdiff_t>(heights_s.size() / 4);
  std::nth_element(heights_s.begin(), quartile, heights_s.end());
  const double limit_s = kFar * std::max(*quartile, kLeastSpread_s);
  std::vector<Point> kept;
  std::copy_if(points_.begin(), points_.end(), std::back_inserter(kept),
               [&](const Point& p) { return height_s(p) <= limit_s; });
  return kept;
}

std::optional<ClockEstimate> ClockFit::estimate() const {
  if (points_.size() < 8) return {};
  if (points_.back().late_s + points_.back().board_s <= 0)
    return {};  // the host's clock stood still: a replay
  const std::vector<Point> points = on_time();
  const auto n = static_cast<double>(points.size());
  if (n < 8 || 2 * points.size() < points_.size()) return {};
  const double span_s = points.back().board_s - points.front().board_s;
  if (span_s < kShortest_s) return {};
  // Orthogonal polynomials of x = board_s - mean: 1, x, q = x^2 - a x - m2.
  double mean_x = 0, mean_y = 0;
  for (const Point& p : points) {
    mean_x += p.board_s / n;
    mean_y += p.late_s / n;
  }
  double m2 = 0, m3 = 0, xy = 0;
  for (const Point& p : points) {
    const double x = p.board_s - mean_x;
    m2 += x * x / n;
    m3 += x * x * x / n;
    xy += x * (p.late_s - mean_y);
  }
  const double a = m3 / m2, slope = xy / (n * m2);
  double qq = 0, qy = 0;
  for (const Point& p : points) {
    const double x = p.board_s - mean_x, q = x * x - a * x - m2;
    qq += q * q;
    qy += q * (p.late_s - mean_y);
  }
  const double curvature = qy / qq;
  double line_rest = 0, parabola_rest = 0;
  for (const Point& p : points) {
    const double x = p.board_s - mean_x, q = x * x - a * x - m2;
    const double rest = p.late_s - mean_y - slope * x;
    line_rest += rest * rest;
    parabola_rest += (rest - curvature * q) * (rest - curvature * q);
  }
  const double nominal_hz = static_cast<double>(tick_hz_) / ticks_per_frame_;
  const double slope_sd = std::sqrt(line_rest / (n - 2) / (n * m2));
  const double curvature_sd = std::sqrt(parabola_rest / (n - 3) / qq);
  if (!(kSigmas95 * slope_sd < kWidest)) return {};
  // A second of the board is 1 + slope seconds of the host; the rate changes by -2 curvature per second.
  const double ppm_h = 2 * 1e6 * 3600;
  return ClockEstimate{.rate_hz = nominal_hz / (1 + slope),
                       .rate_interval_hz = kSigmas95 * nominal_hz * slope_sd,
                       .drift_ppm_h = -ppm_h * curvature,
                       .drift_interval_ppm_h = kSigmas95 * ppm_h * curvature_sd,
                       .span_s = span_s};
}

}  // namespace tunnelrig
