#include "analysis/residual/likelihood/curve_basis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tunnelrig {
namespace {

constexpr double kFarthestBend = 2;  // |s|: half of the range on either side

}  // namespace

bool is_of_logarithm(CurveShape shape) {
  return shape == CurveShape::kLogParabola || shape == CurveShape::kLevelling ||
         shape == CurveShape::kLogStraight || shape == CurveShape::kLogWaves ||
         shape == CurveShape::kLogSmooth;
}

bool has_waves(CurveShape shape) {
  return shape == CurveShape::kWaves || shape == CurveShape::kSmooth || shape == CurveShape::kLogWaves ||
         shape == CurveShape::kLogSmooth;
}

double Strength::at(double x) const { return std::clamp((x - centre) / scale, -1.0, 1.0); }

double curve_straight(CurveShape shape, double x, double low, double high) {
  const double u = is_of_logarithm(shape) ? x > 0 ? std::log(x / low) / std::log(high / low)
                                                  : -std::numeric_limits<double>::infinity()
                                          : (x - low) / (high - low);
  const double farthest = has_waves(shape) ? 1 : kFarthestBend;
  return std::clamp(2 * u - 1, -farthest, farthest);
}

double curve_column(CurveShape shape, int k, double x, double low, double high) {
  const double s = curve_straight(shape, x, low, high);
  const auto wave = [s](int number) { return std::cos(std::numbers::pi * number * (s + 1) / 2); };
  if (shape == CurveShape::kWaves || shape == CurveShape::kLogWaves) return wave(k);
  if (has_waves(shape)) return k == 1 ? s : k == 2 ? s * s : wave(k - 2);
  if (k > 1 || shape == CurveShape::kStraight || shape == CurveShape::kLogStraight) return s;
  return shape == CurveShape::kLevelling ? std::pow(low / high, (s + 1) / 2) : s * s;
}

double tilted_column(CurveShape shape, const std::vector<double>& tilt, std::size_t i, double x, double low,
                     double high) {
  return curve_column(shape, static_cast<int>(i) + 1, x, low, high) -
         (tilt.empty() ? 0 : tilt[i] * curve_straight(shape, x, low, high));
}

double level_column(const std::vector<double>& levels, int k, double x) {
  return x == levels[static_cast<std::size_t>(k)] ? 1 : 0;
}

std::string_view name_of(CurveShape shape) {
  switch (shape) {
    case CurveShape::kWaves:
      return "waves";
    case CurveShape::kLogWaves:
      return "log_waves";
    case CurveShape::kSmooth:
      return "smooth";
    case CurveShape::kLogSmooth:
      return "log_smooth";
    case CurveShape::kParabola:
      return "parabola";
    case CurveShape::kLogParabola:
      return "log_parabola";
    case CurveShape::kLevelling:
      return "levelling";
    case CurveShape::kStraight:
      return "straight";
    case CurveShape::kLogStraight:
      return "log_straight";
    case CurveShape::kLevels:
      return "levels";
  }
  return "";
}

std::optional<CurveShape> curve_shape(std::string_view name) {
  for (const CurveShape shape :
       {CurveShape::kWaves, CurveShape::kLogWaves, CurveShape::kSmooth, CurveShape::kLogSmooth,
        CurveShape::kParabola, CurveShape::kLogParabola, CurveShape::kLevelling, CurveShape::kStraight,
        CurveShape::kLogStraight, CurveShape::kLevels})
    if (name_of(shape) == name) return shape;
  return {};
}

}  // namespace tunnelrig
