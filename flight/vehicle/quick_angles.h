// Arc sine and arc tangent by their series at the small angles where nearly all of a flight is, which is
// quicker; by the library beyond.
#pragma once

#include <cmath>

namespace tunnelrig {

/// To 2e-12 up to 0.3.
inline double quick_asin(double x) {
  const double x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
  if (x2 > 0.09) return std::asin(x);
  const double low = (1 + x2 * (1.0 / 6)) + x4 * (3.0 / 40 + x2 * (15.0 / 336));
  const double high =
      (105.0 / 3456 + x2 * (945.0 / 42240)) + x4 * (10395.0 / 599040 + x2 * (135135.0 / 9676800));
  return x * (low + x8 * (high + x8 * (34459425.0 / 2972712960.0)));
}

/// To 1e-13 up to 0.26.
inline double quick_atan(double x) {
  const double x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
  if (x2 > 0.26 * 0.26) return std::atan(x);
  const double low = (1 - x2 * (1.0 / 3)) + x4 * (1.0 / 5 - x2 * (1.0 / 7));
  const double high = (1.0 / 9 - x2 * (1.0 / 11)) + x4 * (1.0 / 13 - x2 * (1.0 / 15));
  return x * (low + x8 * (high + x8 * (1.0 / 17 - x2 * (1.0 / 19))));
}

/// As std::atan2.
inline double quick_atan2(double y, double x) {
  return x > 0 && std::abs(y) < 0.26 * x ? quick_atan(y / x) : std::atan2(y, x);
}

}  // namespace tunnelrig
