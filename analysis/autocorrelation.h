// The error of a mean when neighbours resemble each other.
#pragma once

#include <span>

namespace tunnelrig {

/// Variance of the mean of a stationary series, by Geyer's initial positive monotone sequence:
/// autocovariances are added in pairs for as long as the pairs stay positive, each at most as large as the
/// one before (Geyer 1992, Stat. Sci. 7:473). A series of independent values gives its variance over their
/// number. Fewer than four values: 0.
double variance_of_mean(std::span<const double> series);

/// A straight line through an equally spaced series.
struct Trend {
  double change = 0;  // last minus first, along the line
  /// The change over its standard error, autocorrelation of the residuals included; by Student's t, as the
  /// deviation of a normal distribution that is as rare.
  double z = 0;
};
Trend trend_of(std::span<const double> series);

}  // namespace tunnelrig
