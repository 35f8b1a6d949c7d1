#include "analysis/residual/curve_basis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tunnelrig {

bool is_of_logarithm(CurveShape shape) {
  return shape == CurveShape::kLogParabola || shape == CurveShape::kLevelling ||
         shape == CurveShape::kLogStraight;
}

double Strength::at(double x) const { return std::clamp((x - centre) / scale, -1.0, 1.0); }

double curve_straight(CurveShape shape, double x, double low, double high) {
  return 2 * (is_of_logarithm(shape) ? std::log(x / low) / std::log(high / low) : (x - low) / (high - low)) -
         1;
}

double curve_column(CurveShape shape, int k, double x, double low, double high) {
  if (shape == CurveShape::kWaves) return std::cos(std::numbers::pi * k * (x - low) / (high - low));
  const double straight = curve_straight(shape, x, low, high);
  if (k > 1 || shape == CurveShape::kStraight || shape == CurveShape::kLogStraight) return straight;
  return shape == CurveShape::kLevelling ? low / x : straight * straight;
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
       {CurveShape::kWaves, CurveShape::kParabola, CurveShape::kLogParabola, CurveShape::kLevelling,
        CurveShape::kStraight, CurveShape::kLogStraight, CurveShape::kLevels})
    if (name_of(shape) == name) return shape;
  return {};
}

}  // namespace tunnelrig
