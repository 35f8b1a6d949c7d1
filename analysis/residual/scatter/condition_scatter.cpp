#include "analysis/residual/scatter/condition_scatter.h"

#include "analysis/residual/observations/condition_values.h"
#include "analysis/residual/scatter/alike.h"
#include "analysis/residual/scatter/run_correlation.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kMostConditions = 2;
constexpr double kLeastSpan = 1.5;  // of the most to the least scatter: less changes nothing
constexpr double kLeastMore = 1.1;  // likewise, of a condition that is known already
constexpr double kMostSpan = 20;    // a weight of 400: the calmest runs are not all that counts
constexpr Index kFewestRuns = 20;

/// z of n runs: its mean over those that count is 0, it lies within what these have, and is NaN where it is
/// not known.
struct Condition {
  std::string name;
  VectorXd z;
};

/// By how much the likelihood of sizes of Laplace's distribution, whose tails are heavy, is larger where
/// their scale goes with e^(γz), and γ: at the least of ln Σ size e^(−γz), which is convex.
struct Gain {
  double log_likelihood = 0, gamma = 0;
};

Gain gain_of(const VectorXd& size, const VectorXd& z) {
  constexpr int kMostSteps = 30;
  constexpr double kStill = 1e-6;
  const double range = z.maxCoeff() - z.minCoeff(), most = std::log(kMostSpan) / range;
  double gamma = 0;
  for (int step = 0; step < kMostSteps; ++step) {
    const VectorXd weight = size.array() * (-gamma * z.array()).exp();
    const double mean = weight.dot(z) / weight.sum();
    const double variance = weight.dot((z.array() - mean).square().matrix()) / weight.sum();
    // No step is longer than what changes sizes by a factor of e.
    const double change = std::clamp(mean / std::max(variance, 1e-300), -1 / range, 1 / range);
    gamma = std::clamp(gamma + change, -most, most);
    if (std::abs(change) * range < kStill) break;
  }
  const double ratio = (size.array() * (-gamma * z.array()).exp()).sum() / size.sum();
  return {-static_cast<double>(size.size()) * std::log(ratio), gamma};
}

/// Of the runs that count, an entry each.
struct Sizes {
  std::vector<int> rows;
  VectorXd left;   // over what is expected of runs that are alike
  MatrixXd alike;  // likewise, of data sets
};

Sizes relative(const RunSizes& sizes) {
  constexpr double kLeastLeft = 0.05;  // of the only run at a location, nothing
  const VectorXd expected = sizes.alike.rowwise().mean();
  Sizes result;
  std::vector<Index> kept;
  for (Index r = 0; r < expected.size(); ++r)
    if (expected(r) > kLeastLeft * expected.maxCoeff()) {
      kept.push_back(r);
      result.rows.push_back(sizes.rows[static_cast<std::size_t>(r)]);
    }
  const VectorXd inverse = VectorXd(expected(kept)).cwiseInverse();
  result.left = VectorXd(sizes.left(kept)).cwiseProduct(inverse);
  result.alike = inverse.asDiagonal() * MatrixXd(sizes.alike(kept, Eigen::all));
  return result;
}

/// Between which all but a few lie, who should not say what others scatter.
struct Inner {
  double low, high;
};

Inner inner(VectorXd values) {
  constexpr double kFew = 0.025;  // at either end
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values(static_cast<Index>(share * static_cast<double>(values.size())));
  };
  return {at(kFew), at(1 - kFew)};
}

std::vector<Condition> conditions_of(const Observations& observations, const std::vector<int>& rows,
                                     const MatrixXd& predicted) {
  constexpr double kRatio = 2;       // values that differ by less differ alike as their logarithms do
  constexpr double kNothing = 0.02;  // of the largest response: what is below has no logarithm to speak of
  std::vector<Condition> result;
  const auto add = [&](const std::string& name, VectorXd z) {
    const VectorXd own = z(rows);
    if (own.array().isNaN().any()) return;
    const auto [low, high] = inner(own);
    if (!(high > low)) return;
    z = z.array().isNaN().select(z, z.cwiseMax(low).cwiseMin(high));
    z.array() -= VectorXd(z(rows)).mean();
    result.push_back({name, std::move(z)});
  };
  const VectorXd size = predicted.cwiseAbs().rowwise().mean();
  const double largest = size.array().isNaN().select(0, size).maxCoeff();
  if (largest > 0)
    add("the predicted " + observations.response, size.cwiseMax(kNothing * largest).array().log());
  for (const Covariate& covariate : observations.covariates)
    if (!covariate.per_channel() && covariate.labels.empty() && can_be_followed(observations, covariate)) {
      const VectorXd x = covariate.value.col(0);
      add(covariate.name, x);
      if (x.minCoeff() > 0 && x.maxCoeff() > kRatio * x.minCoeff()) add(covariate.name, x.array().log());
    }
  return result;
}

struct Best {
  std::size_t condition = 0;
  Gain gain;
};

Best best_of(const std::vector<VectorXd>& z, const VectorXd& size) {
  Best best;
  for (std::size_t i = 0; i < z.size(); ++i)
    if (const Gain gain = gain_of(size, z[i]); gain.log_likelihood > best.gain.log_likelihood)
      best = {i, gain};
  return best;
}

/// Whether the best of all conditions does as well where there is nothing: in runs that are alike, or in
/// these sizes, whatever their tails, dealt out anew.
bool is_by_chance(const std::vector<VectorXd>& z, const VectorXd& size, const MatrixXd& alike,
                  double log_likelihood, std::mt19937_64& random) {
  VectorXd dealt = size;
  for (Index set = 0; set < alike.cols(); ++set) {
    std::shuffle(dealt.begin(), dealt.end(), random);
    if (best_of(z, alike.col(set)).gain.log_likelihood >= log_likelihood ||
        best_of(z, dealt).gain.log_likelihood >= log_likelihood)
      return true;
  }
  return false;
}

/// By e^(γz), within what most of the runs that count have: what two conditions say of values that they never
/// had together is a guess.
void multiply(RunScatter::ByCondition& known, const Condition& condition, double gamma,
              const std::vector<int>& rows) {
  const VectorXd log = gamma * condition.z;
  VectorXd runs = log.array().isNaN().select(0, log).array().exp();
  if (known.runs.size() > 0) runs.array() *= known.runs.array();
  const Inner of_most = inner(runs(rows));
  runs = runs.cwiseMax(std::max(of_most.low, of_most.high / kMostSpan)).cwiseMin(of_most.high);
  const VectorXd own = runs(rows);
  known.names.insert(condition.name);
  known.runs = runs / std::sqrt(own.squaredNorm() / static_cast<double>(own.size()));
}

/// Lets `known` go with one condition more, or more with one that it has: where `sizes`, of a model with what
/// is known, do, beside those of data sets whose runs are alike, and beside the same dealt out anew.
bool let_scatter_differ(const Observations& observations, const RunSizes& sizes, const MatrixXd& predicted,
                        std::mt19937_64& random, RunScatter::ByCondition& known) {
  const Sizes of = relative(sizes);
  if (static_cast<Index>(of.rows.size()) < kFewestRuns) return false;
  // What goes on from row to row is no scatter: the model has the wrong shape there.
  if (observations.blocks_are_rows && row_correlation(observations, sizes.rows, sizes.common) > 0)
    return false;
  const std::vector<Condition> conditions = conditions_of(observations, of.rows, predicted);
  const auto take_best = [&](bool of_known) {
    std::vector<VectorXd> z;
    std::vector<const Condition*> of_z;
    for (const Condition& condition : conditions)
      if (known.names.contains(condition.name) == of_known) {
        z.emplace_back(condition.z(of.rows));
        of_z.push_back(&condition);
      }
    const auto [best, gain] = best_of(z, of.left);
    if (!(gain.log_likelihood > 0)) return false;
    const double span = std::abs(gain.gamma) * (z[best].maxCoeff() - z[best].minCoeff());
    if (span < std::log(of_known ? kLeastMore : kLeastSpan)) return false;
    if (!of_known && is_by_chance(z, of.left, of.alike, gain.log_likelihood, random)) return false;
    multiply(known, *of_z[best], gain.gamma, of.rows);
    return true;
  };
  return take_best(true) || (known.names.size() < kMostConditions && take_best(false));
}

}  // namespace

ScatterFit condition_scatter(const Observations& observations, const std::vector<int>& rows,
                             const Components& y, const std::vector<Components>& columns,
                             const MatrixXd& predicted, std::mt19937_64& random) {
  // While calm runs count no more than others, what is left of them has a part of theirs: in steps.
  constexpr int kMostSteps = 8;
  Observations scattered = observations;
  scattered.scatter = {};
  ScatterFit result;
  for (int step = 0; step < kMostSteps; ++step) {
    const MixedModel model(scattered, rows);
    result = {scattered.scatter.by_condition, CandidateScan(model, columns, {}).null_fit(y)};
    if (!let_scatter_differ(observations, run_sizes(model, result.variances, y, columns, random), predicted,
                            random, scattered.scatter.by_condition))
      break;
  }
  return result;
}

}  // namespace tunnelrig
