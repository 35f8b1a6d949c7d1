#include "analysis/residual/likelihood/held_out.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// What the fit leaves for prediction: everything stratum by stratum.
struct Fit {
  VectorXd amplitude;
  MatrixXd covariance;              // of the amplitudes
  std::vector<Stacked> y, columns;  // of the fitted runs
};

Fit fit_amplitudes(const MixedModel& model, const Components& y, const std::vector<const Components*>& items,
                   const NullFit& null) {
  const Index k = static_cast<Index>(items.size());
  Fit fit{VectorXd::Zero(k), MatrixXd::Zero(k, k), {}, {}};
  MatrixXd a = MatrixXd::Zero(k, k);
  VectorXd b = VectorXd::Zero(k);
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    fit.y.push_back(model.stack(s, {&y}));
    fit.columns.push_back(model.stack(s, items));
    if (k == 0) continue;
    Stacked projected_y = fit.y[s], projected = fit.columns[s];
    model.project(s, null.ratio[s], projected_y);
    model.project(s, null.ratio[s], projected);
    const double weight = 1 / std::max(null.sigma[s] * null.sigma[s], 1e-300);
    a += weight * projected.transpose() * projected;
    b += weight * projected.transpose() * projected_y.col(0);
  }
  if (k == 0) return fit;
  // Collinear columns share their amplitude instead of running away.
  const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(a);
  fit.amplitude = solver.solve(b);
  fit.covariance = solver.pseudoInverse();
  return fit;
}

/// What runs and their sessions scatter, σ² (U Φ U + a J) of (2); neighbours are those of the same block
/// among `rows`.
class RunCovariance {
 public:
  RunCovariance(const Observations& observations, const std::vector<int>& rows, const VectorXd& scatter,
                double sigma, double ratio, double run_correlation)
      : std_(sigma * scatter),
        session_(sigma * sigma * ratio),
        place_(rows.size()),
        block_(rows.size()),
        correlation_(run_correlation) {
    for (const auto& [block, runs] : places_of_each(observations.block, rows))
      for (std::size_t i = 0; i < runs.size(); ++i) {
        place_[static_cast<std::size_t>(runs[i])] = static_cast<double>(i);
        block_[static_cast<std::size_t>(runs[i])] = block;
      }
  }

  MatrixXd operator()(const std::vector<Index>& a, const std::vector<Index>& b) const {
    return MatrixXd::NullaryExpr(static_cast<Index>(a.size()), static_cast<Index>(b.size()),
                                 [&](Index i, Index j) {
                                   return of(static_cast<std::size_t>(a[static_cast<std::size_t>(i)]),
                                             static_cast<std::size_t>(b[static_cast<std::size_t>(j)]));
                                 });
  }

  VectorXd of_runs(const std::vector<Index>& runs) const { return std_(runs); }

 private:
  double of(std::size_t a, std::size_t b) const {
    if (block_[a] != block_[b]) return 0;
    return session_ + std_(static_cast<Index>(a)) * std_(static_cast<Index>(b)) *
                          std::pow(correlation_, std::abs(place_[a] - place_[b]));
  }

  VectorXd std_;
  double session_;
  std::vector<double> place_;  // of a run within its block
  std::vector<int> block_;
  double correlation_;
};

/// Where whole groups are held out, a group's constant and slopes are fitted to every other run of it; the
/// rest is scored, if there are as many runs as coefficients. `residual` came with NaN there because the
/// model has no such group: `plain` is the same without any baseline. `covariance`: of what runs scatter;
/// `columns`: stacked, of amplitudes that have `of_amplitudes`.
void fit_own_baselines(const Observations& observations, const std::vector<int>& rows,
                       const std::vector<OwnBaseline>& own_groups, const RunCovariance& covariance,
                       const MatrixXd& plain, const Stacked& columns, const MatrixXd& of_amplitudes,
                       MatrixXd& residual, MatrixXd& variance) {
  const MatrixXd design = observations.baseline_columns(rows);
  for (const auto& [fitted, scored] : own_groups) {
    const MatrixXd of_fitted = covariance(fitted, fitted), shared = covariance(scored, fitted);
    const VectorXd weight = covariance.of_runs(fitted).cwiseInverse();
    const MatrixXd x = weight.asDiagonal() * design(fitted, Eigen::all), wanted = design(scored, Eigen::all);
    if (x.rows() < x.cols()) continue;
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(x);
    const MatrixXd share = wanted * solver.pseudoInverse() * weight.asDiagonal();  // of each fitted run
    residual(scored, Eigen::all) = plain(scored, Eigen::all) - share * plain(fitted, Eigen::all);
    // What a run shares with its neighbours is in the group's own constant as well.
    for (std::size_t m = 0; m < scored.size(); ++m) {
      const auto w = share.row(static_cast<Index>(m));
      variance.row(scored[m]).setConstant(covariance({scored[m]}, {scored[m]})(0, 0) -
                                          2 * w.dot(shared.row(static_cast<Index>(m))) +
                                          w.dot(w * of_fitted));
    }
    for (Index mode = 0; mode < variance.cols() && columns.cols() > 0; ++mode) {
      const auto own = columns.middleRows(mode * variance.rows(), variance.rows());
      const MatrixXd left = own(scored, Eigen::all) - share * own(fitted, Eigen::all);
      variance(scored, mode) += (left * of_amplitudes).cwiseProduct(left).rowwise().sum();
    }
  }
}

/// V^(−½)e of one stratum. Missing errors count as none.
VectorXd whitened(const Observations& observations, const std::vector<int>& rows, const MatrixXd& error,
                  const VectorXd& scatter, double sigma, double ratio, double run_correlation) {
  MatrixXd result = error.array().isNaN().select(0, error);
  auto blocks = without_numbers(places_of_each(observations.block, rows));
  for (std::vector<Index>& runs : blocks)
    std::erase_if(runs, [&](Index r) { return std::isnan(error(r, 0)); });
  std::erase_if(blocks, [](const std::vector<Index>& runs) { return runs.empty(); });
  whiten(blocks, scatter, ratio, run_correlation, result);
  return result.reshaped() / std::max(sigma, 1e-150);
}

VectorXd concatenated(const std::vector<VectorXd>& parts) {
  Index size = 0;
  for (const VectorXd& part : parts) size += part.size();
  VectorXd result(size);
  Index at = 0;
  for (const VectorXd& part : parts) {
    result.segment(at, part.size()) = part;
    at += part.size();
  }
  return result;
}

/// What one stratum's model says of runs that it has not seen: errors and variances, runs × modes.
struct StratumErrors {
  MatrixXd error, variance;
  VectorXd whitened;
};

/// y and the columns of the runs to predict, without a baseline.
struct Plain {
  Stacked y, columns;
};

StratumErrors errors_of_stratum(const Observations& observations, const MixedModel& model, std::size_t s,
                                const Fit& fit, const NullFit& null, Plain plain,
                                const std::vector<int>& rows, const std::vector<OwnBaseline>& own_groups) {
  const MixedModel::Stratum& stratum = model.strata()[s];
  const Index n = static_cast<Index>(rows.size());
  const double sigma = null.sigma[s], ratio = kRatios[null.ratio[s]];
  const VectorXd scatter = stratum.means() ? observations.scatter.of_runs(rows) : VectorXd(VectorXd::Ones(n));
  Stacked residual = plain.y - model.baseline_prediction(s, null.ratio[s], fit.y[s], rows);
  Stacked variance = (scatter.array().square() + ratio).replicate(stratum.modes, 1);
  variance += model.baseline_variance(s, null.ratio[s], rows).replicate(stratum.modes, 1);
  variance *= sigma * sigma;
  if (plain.columns.cols() > 0) {
    const Stacked x = plain.columns - model.baseline_prediction(s, null.ratio[s], fit.columns[s], rows);
    plain.y -= plain.columns * fit.amplitude;
    residual -= x * fit.amplitude;
    variance += ((x * fit.covariance).array() * x.array()).rowwise().sum().matrix();
  }
  StratumErrors result{residual.reshaped(n, stratum.modes), variance.reshaped(n, stratum.modes), {}};
  if (stratum.means() && !own_groups.empty())
    fit_own_baselines(observations, rows, own_groups,
                      RunCovariance(observations, rows, scatter, sigma, ratio, model.run_correlation(s)),
                      plain.y.reshaped(n, stratum.modes), plain.columns, fit.covariance, result.error,
                      result.variance);
  result.whitened =
      whitened(observations, rows, result.error, scatter, sigma, ratio, model.run_correlation(s));
  return result;
}

/// From errors of y and what they scatter by.
void set_in_response_unit(const Observations& observations, const MatrixXd& error_y, const MatrixXd& std_y,
                          HeldOutErrors& result) {
  const MatrixXd value = observations.value(result.rows, Eigen::all),
                 known = observations.known(result.rows, Eigen::all);
  if (observations.multiplicative) {
    const MatrixXd predicted = value.array() * (-error_y).array().exp();
    result.error = predicted - value;
    result.expected_std = predicted.cwiseAbs().cwiseProduct(std_y);
  } else {
    result.error = -known.cwiseProduct(error_y);
    result.expected_std = known.cwiseAbs().cwiseProduct(std_y);
  }
}

}  // namespace

double HeldOutErrors::sum_of_squares() const { return error.array().isNaN().select(0, error).squaredNorm(); }

Index HeldOutErrors::count() const { return error.size() - error.array().isNaN().count(); }

AmplitudeFit fit_amplitudes(const Observations& observations, const Components& y,
                            const std::vector<Components>& columns, const NullFit& null,
                            const std::vector<int>& rows) {
  const std::vector<const Components*> items = pointers_to(columns);
  const Fit fit = fit_amplitudes(MixedModel(observations, rows, null.ratio), y, items, null);
  return {fit.amplitude, fit.covariance};
}

HeldOutErrors predict_held_out(const Observations& observations, const Components& y,
                               const std::vector<Components>& columns, const NullFit& null,
                               const std::vector<int>& fit_rows, const std::vector<int>& test_rows) {
  const MixedModel model(observations, fit_rows, null.ratio);
  const MixedModel test = MixedModel::baseline_alone(observations, test_rows);
  const std::vector<const Components*> items = pointers_to(columns);
  const Fit fit = fit_amplitudes(model, y, items, null);
  const std::vector<OwnBaseline> own_groups = own_baselines(observations, fit_rows, test_rows);
  const Index n = static_cast<Index>(test_rows.size()), c = observations.channels();
  std::vector<VectorXd> parts;
  MatrixXd error_by_mode = MatrixXd::Zero(n, c), variance_by_mode = MatrixXd::Zero(n, c);
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    const MixedModel::Stratum& stratum = model.strata()[s];
    StratumErrors own = errors_of_stratum(observations, model, s, fit, null,
                                          {test.stack(s, {&y}), test.stack(s, items)}, test_rows, own_groups);
    parts.push_back(std::move(own.whitened));
    if (!stratum.means()) continue;
    error_by_mode.middleCols(stratum.first_mode, stratum.modes) = own.error;
    variance_by_mode.middleCols(stratum.first_mode, stratum.modes) = own.variance;
  }
  HeldOutErrors result{test_rows, {}, {}, concatenated(parts), fit.amplitude};
  set_in_response_unit(observations, error_by_mode * model.rotors_of_modes(),
                       (variance_by_mode * model.rotors_of_modes().cwiseAbs2()).cwiseSqrt(), result);
  return result;
}

std::vector<OwnBaseline> own_baselines(const Observations& observations, const std::vector<int>& fit_rows,
                                       const std::vector<int>& test_rows) {
  std::vector<OwnBaseline> result;
  if (!observations.groups_within_blocks && observations.held_out.empty()) return result;
  const auto seen = places_of_each(observations.group, fit_rows);
  for (const auto& [group, members] : places_of_each(observations.group, test_rows)) {
    if (seen.contains(group)) continue;
    OwnBaseline& own = result.emplace_back();
    for (std::size_t m = 0; m < members.size(); ++m)
      (m % 2 == 0 ? own.fitted : own.scored).push_back(members[m]);
  }
  return result;
}

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

double CrossValidation::rmse() const {
  double squares = 0;
  Index count = 0;
  for (const HeldOutErrors& fold : folds) {
    squares += fold.sum_of_squares();
    count += fold.count();
  }
  return count == 0 ? kNaN : std::sqrt(squares / static_cast<double>(count));
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
    // Where one of them has too few runs for its coefficients, they are not held against the same runs.
    if (worse.folds[fold].count() != better.folds[fold].count())
      difference(static_cast<Index>(fold)) = 0;
    else
      distance2 += (worse.folds[fold].whitened - better.folds[fold].whitened).squaredNorm();
  const double n = static_cast<double>(difference.size());
  LossDifference result{.mean = difference.mean(), .total = difference.sum()};
  result.standard_error = std::sqrt((difference.array() - result.mean).square().sum() / (n * (n - 1)));
  result.expected_standard_error = 2 * std::sqrt(distance2) / n;
  return result;
}

bool LossDifference::told_apart() const {
  constexpr double kLikelihoodRatio = 20;
  return mean >= 2 * std::min(standard_error, expected_standard_error) &&
         total >= 2 * std::log(kLikelihoodRatio);
}

}  // namespace tunnelrig
