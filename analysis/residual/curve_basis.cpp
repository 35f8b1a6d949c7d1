#include "analysis/residual/curve_basis.h"

#include <cmath>
#include <numbers>

namespace tunnelrig {

double curve_place(CurveShape shape, double x, double low, double high) {
  if (shape == CurveShape::kLogParabola) return std::log(x / low) / std::log(high / low);
  return (x - low) / (high - low);
}

double curve_column(CurveShape shape, int k, double u) {
  if (shape == CurveShape::kWaves) return std::cos(std::numbers::pi * k * u);
  return k == 1 ? (2 * u - 1) * (2 * u - 1) : 2 * u - 1;
}

std::string_view name_of(CurveShape shape) {
  switch (shape) {
    case CurveShape::kWaves:
      return "waves";
    case CurveShape::kParabola:
      return "parabola";
    case CurveShape::kLogParabola:
      return "log_parabola";
  }
  return "";
}

std::optional<CurveShape> curve_shape(std::string_view name) {
  for (const CurveShape shape : {CurveShape::kWaves, CurveShape::kParabola, CurveShape::kLogParabola})
    if (name_of(shape) == name) return shape;
  return {};
}

}  // namespace tunnelrig
