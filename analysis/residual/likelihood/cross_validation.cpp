#include "analysis/residual/likelihood/cross_validation.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace tunnelrig {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

bool score_the_same_runs(const HeldOutErrors& a, const HeldOutErrors& b) {
  return (a.error.array().isNaN() == b.error.array().isNaN()).all();
}

}  // namespace

std::vector<Fold> leave_out_blocks(const Observations& observations, const std::vector<int>& rows) {
  std::map<int, std::size_t> fold_of;
  for (const int row : rows) fold_of.emplace(observations.block[static_cast<std::size_t>(row)], 0);
  std::size_t next = 0;
  for (auto& [block, fold] : fold_of) fold = next++ % kMostFolds;
  std::vector<Fold> folds(std::min(fold_of.size(), kMostFolds));
  for (const int row : rows) {
    const std::size_t own = fold_of.at(observations.block[static_cast<std::size_t>(row)]);
    for (std::size_t fold = 0; fold < folds.size(); ++fold)
      (fold == own ? folds[fold].left_out : folds[fold].kept).push_back(row);
  }
  return folds;
}

CrossValidation cross_validate(const Observations& observations, const Components& y,
                               const std::vector<Components>& columns, const NullFit& null,
                               const std::vector<int>& rows) {
  CrossValidation result;
  for (const Fold& fold : leave_out_blocks(observations, rows))
    result.folds.push_back(predict_held_out(observations, y, columns, null, fold.kept, fold.left_out));
  return result;
}

HeldOutErrors CrossValidation::all() const {
  HeldOutErrors result;
  for (const HeldOutErrors& fold : folds) {
    const Index before = result.error.rows();
    result.rows.insert(result.rows.end(), fold.rows.begin(), fold.rows.end());
    const Index rows = before + fold.error.rows();
    result.error.conservativeResize(rows, fold.error.cols());
    result.error.bottomRows(fold.error.rows()) = fold.error;
    result.expected_std.conservativeResize(rows, fold.error.cols());
    result.expected_std.bottomRows(fold.error.rows()) = fold.expected_std;
  }
  return result;
}

VectorXd CrossValidation::losses() const {
  VectorXd result(static_cast<Index>(folds.size()));
  for (std::size_t fold = 0; fold < folds.size(); ++fold)
    result(static_cast<Index>(fold)) = folds[fold].loss();
  return result;
}

LossDifference compare(const CrossValidation& worse, const CrossValidation& better) {
  VectorXd difference = worse.losses() - better.losses();
  double distance2 = 0;
  for (std::size_t fold = 0; fold < worse.folds.size(); ++fold)
    // One of them may have too few runs for its coefficients, or an amplitude that only these runs tell.
    if (!score_the_same_runs(worse.folds[fold], better.folds[fold]))
      difference(static_cast<Index>(fold)) = 0;
    else
      distance2 += (worse.folds[fold].whitened - better.folds[fold].whitened).squaredNorm();
  const double n = static_cast<double>(difference.size());
  LossDifference result{.mean = difference.mean(), .total = difference.sum()};
  result.standard_error = std::sqrt((difference.array() - result.mean).square().sum() / (n * (n - 1)));
  result.expected_standard_error = 2 * std::sqrt(distance2) / n;
  return result;
}

double rmse_gain(const CrossValidation& worse, const CrossValidation& better) {
  double of_worse = 0, of_better = 0;  // sums of squares
  Index count = 0;
  for (std::size_t fold = 0; fold < worse.folds.size(); ++fold) {
    if (!score_the_same_runs(worse.folds[fold], better.folds[fold])) continue;
    of_worse += worse.folds[fold].sum_of_squares();
    of_better += better.folds[fold].sum_of_squares();
    count += worse.folds[fold].count();  // the same of both
  }
  if (count == 0) return 0;
  const double n = static_cast<double>(count), gain = std::sqrt(of_worse / n) - std::sqrt(of_better / n);
  return std::isfinite(gain) ? gain : 0;
}

bool LossDifference::told_apart() const {
  constexpr double kLikelihoodRatio = 20;
  return mean >= 2 * std::min(standard_error, expected_standard_error) &&
         total >= 2 * std::log(kLikelihoodRatio);
}

}  // namespace tunnelrig
