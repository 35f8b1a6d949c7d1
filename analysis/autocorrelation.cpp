#include "analysis/autocorrelation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace tunnelrig {
namespace {

double mean_of(std::span<const double> series) {
  return std::accumulate(series.begin(), series.end(), 0.0) / static_cast<double>(series.size());
}

double autocovariance(const std::vector<double>& centred, std::size_t lag) {
  double sum = 0;
  for (std::size_t i = lag; i < centred.size(); ++i) sum += centred[i] * centred[i - lag];
  return sum / static_cast<double>(centred.size());
}

/// The deviation of a normal distribution that is as rare as t of Student's (Wallace 1959).
double normal_of_student_t(double t, double dof) {
  const double size = std::sqrt(dof * std::log1p(t * t / dof)) * (8 * dof + 1) / (8 * dof + 3);
  return std::copysign(size, t);
}

/// Geyer's sum of autocovariances, the first of them, and how many on both sides of it were added.
struct Covariances {
  double sum = 0, own = 0, added = 1;

  /// Values for each that counts in an estimate of the sum: twice what noise of this sum has for each
  /// independent one, or all that were added where that is less. Of three quarters of the series at most.
  double per_degree(double count) const {
    return own > 0 ? std::clamp(std::min(added, 2 * sum / own), 1.0, 0.75 * count) : 1;
  }
};

Covariances covariances_of(std::span<const double> series) {
  const double mean = mean_of(series);
  std::vector<double> centred(series.begin(), series.end());
  for (double& value : centred) value -= mean;

  const double own = autocovariance(centred, 0);
  double sum = -own;
  double last_pair = INFINITY, added = 1;
  for (std::size_t lag = 0; lag + 1 < series.size() / 2; lag += 2) {
    const double pair = autocovariance(centred, lag) + autocovariance(centred, lag + 1);
    if (pair <= 0) break;
    last_pair = std::min(last_pair, pair);
    sum += 2 * last_pair;
    added = 2 * static_cast<double>(lag) + 3;
  }
  // Blocks that alternate make the mean better known than independent ones; a series of them never makes it
  // certain.
  return {std::max(sum, 0.05 * own), own, added};
}

}  // namespace

double variance_of_mean(std::span<const double> series) {
  if (series.size() < 4) return 0;
  return covariances_of(series).sum / (static_cast<double>(series.size()) - 1);
}

MeanKnowledge knowledge_of_mean(std::span<const double> series) {
  if (series.size() < 4) return {0, std::numeric_limits<double>::infinity()};
  const auto count = static_cast<double>(series.size());
  const Covariances covariances = covariances_of(series);
  const double each = covariances.per_degree(count);
  return {covariances.sum / (count - each), std::max(1.0, count / each - 1)};
}

Trend trend_of(std::span<const double> series) {
  if (series.size() < 4) return {};
  const auto count = static_cast<double>(series.size());
  const double centre = (count - 1) / 2;
  const double mean = mean_of(series);
  double cross = 0, spread = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double x = static_cast<double>(i) - centre;
    cross += x * (series[i] - mean);
    spread += x * x;
  }
  const double slope = cross / spread;
  std::vector<double> residual(series.begin(), series.end());
  for (std::size_t i = 0; i < residual.size(); ++i) residual[i] -= slope * (static_cast<double>(i) - centre);
  // var(slope) = s²/Σx² for independent residuals; the autocorrelation inflates it as it does the mean's
  // variance. That residuals alternate is chance in a short run, and makes no slope better known.
  double squares = 0;
  for (const double value : residual) squares += (value - mean) * (value - mean);
  const double of_mean = std::max(variance_of_mean(residual), squares / (count * (count - 1)));
  const double error = std::sqrt(of_mean * count * (count - 1) / ((count - 2) * spread)) * (count - 1);
  const double change = slope * (count - 1);
  // Short series resemble slow noise by chance; of fewer degrees of freedom nothing would be a drift.
  constexpr double kFewest = 5;
  const double independent = count / covariances_of(residual).per_degree(count);
  const double dof = std::max(independent - 2, std::min(count - 2, kFewest));
  return {change, error > 0 ? normal_of_student_t(change / error, dof) : 0};
}

}  // namespace tunnelrig
