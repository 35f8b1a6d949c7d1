// Evidence of a likelihood ratio.
#pragma once

#include "calibration/distributions.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace tunnelrig {

/// −log10 of the upper tail of F(k, N − k) at a likelihood ratio; tabulated, since it is asked a million
/// times.
class EvidenceTable {
 public:
  EvidenceTable(int columns, double degrees_of_freedom) {
    const double k = columns;
    for (std::size_t i = 0; i < kEntries; ++i) {
      const double ratio = kStep * static_cast<double>(i);
      const double f = std::expm1(2 * ratio / degrees_of_freedom) * (degrees_of_freedom - k) / k;
      const double p = f_upper_p(f, k, degrees_of_freedom - k);
      entries_[i] = p > 1e-290 ? -std::log10(p) : entries_[i - 1] + kStep / std::numbers::ln10;
    }
  }
  double operator()(double ratio) const {
    const double at = ratio / kStep;
    if (at >= kEntries - 1)
      return entries_[kEntries - 1] + (ratio - kStep * (kEntries - 1)) / std::numbers::ln10;
    const auto i = static_cast<std::size_t>(at);
    return entries_[i] + (at - static_cast<double>(i)) * (entries_[i + 1] - entries_[i]);
  }

 private:
  static constexpr std::size_t kEntries = 1500;
  static constexpr double kStep = 0.1;
  std::array<double, kEntries> entries_{};
};

}  // namespace tunnelrig
