#include "attribution/scorer/intervals.h"

#include <cmath>

namespace tunnelrig::attribution {
namespace {

constexpr double kZ = 1.959963984540054;

/// P(X <= successes) of `trials` with chance p.
double binomial_cdf(int successes, int trials, double p) {
  double sum = 0;
  for (int k = 0; k <= successes; ++k) {
    const double log_choose =
        std::lgamma(trials + 1.0) - std::lgamma(k + 1.0) - std::lgamma(trials - k + 1.0);
    sum += std::exp(log_choose + k * std::log(p) + (trials - k) * std::log1p(-p));
  }
  return sum;
}

/// The chance at which P(X <= successes) is `level`; the function falls with the chance.
double chance_at(int successes, int trials, double level) {
  double low = 0, high = 1;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (binomial_cdf(successes, trials, middle) > level ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace

Interval clopper_pearson(int successes, int trials) {
  if (trials == 0) return {};
  return {.low = successes == 0 ? 0 : chance_at(successes - 1, trials, 0.975),
          .high = successes == trials ? 1 : chance_at(successes, trials, 0.025)};
}

Interval wilson(int successes, int trials) {
  if (trials == 0) return {};
  const double n = trials, share = successes / n, square = kZ * kZ;
  const double centre = (share + square / (2 * n)) / (1 + square / n);
  const double half = kZ * std::sqrt(share * (1 - share) / n + square / (4 * n * n)) / (1 + square / n);
  return {.low = std::max(0.0, centre - half), .high = std::min(1.0, centre + half)};
}

MeanInterval mean_interval(std::span<const double> values) {
  MeanInterval result;
  const auto n = static_cast<double>(values.size());
  for (const double value : values) result.mean += value / n;
  if (values.size() < 2) return result;
  double square = 0;
  for (const double value : values) square += (value - result.mean) * (value - result.mean);
  const double half = kZ * std::sqrt(square / (n - 1) / n);
  result.interval = {result.mean - half, result.mean + half};
  return result;
}

}  // namespace tunnelrig::attribution
