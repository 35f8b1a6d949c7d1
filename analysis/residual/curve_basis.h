// Columns of curves without a name, over a covariate from `low` to `high`.
#pragma once

#include <optional>
#include <string_view>

namespace tunnelrig {

enum class CurveShape {
  kWaves,        // cos(π k u), k = 1 …: bends of ever shorter length
  kParabola,     // (2u − 1)²: what a straight line lacks; 2u − 1 where it stands alone
  kLogParabola,  // the same over the logarithm: what a power law lacks
};

/// u: 0 at `low`, 1 at `high`, beyond them outside.
double curve_place(CurveShape shape, double x, double low, double high);

/// The k-th column (from 1) at u.
double curve_column(CurveShape shape, int k, double u);

/// "waves", "parabola", "log_parabola".
std::string_view name_of(CurveShape shape);
std::optional<CurveShape> curve_shape(std::string_view name);

}  // namespace tunnelrig
