#pragma once

#include <algorithm>
#include <limits>
#include <vector>

namespace tunnelrig {

/// The value in the middle, of an even number the upper one: always one that is there. NaN of none.
inline double upper_median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace tunnelrig
