// The error of a mean when neighbours resemble each other.
#pragma once

#include <span>

namespace tunnelrig {

/// Variance of the mean of a stationary series, by Geyer's initial positive monotone sequence:
/// autocovariances are added in pairs for as long as the pairs stay positive, each at most as large as the
/// one before (Geyer 1992, Stat. Sci. 7:473). A series of independent values gives its variance over their
/// number. Fewer than four values: 0.
double variance_of_mean(std::span<const double> series);

/// How well the mean of a stationary series is known from it alone. Noise that lasts as long as a good part
/// of the series says little of its own size: where m values make one that counts there are n/m − 1 degrees
/// of freedom, and as the mean takes one of the n/m away the variance is larger by that than the one above. m
/// is 4τ (τ: Geyer's sum over twice the variance of a value), or the number of autocovariances in the sum
/// where that is less. Fewer than four values: 0, and infinitely many.
struct MeanKnowledge {
  double variance = 0, dof = 0;
};
MeanKnowledge knowledge_of_mean(std::span<const double> series);

/// A straight line through an equally spaced series.
struct Trend {
  double change = 0;  // last minus first, along the line
  /// The change over its standard error, autocorrelation of the residuals included; by Student's t of as many
  /// degrees of freedom as the residuals' noise has within the series, as the deviation of a normal
  /// distribution that is as rare.
  double z = 0;
};
Trend trend_of(std::span<const double> series);

}  // namespace tunnelrig
