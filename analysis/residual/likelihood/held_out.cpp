#include "analysis/residual/likelihood/held_out.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double weight_of(double sigma) { return 1 / std::max(sigma * sigma, 1e-300); }

/// Normal equations of the amplitudes, a x = b, the baseline taken out of both.
struct NormalEquations {
  MatrixXd a;
  VectorXd b;
  VectorXd plain;  // the columns' squares with the baseline still in them
};

/// What the fit leaves for prediction: everything stratum by stratum.
struct Fit {
  VectorXd amplitude;
  MatrixXd covariance;              // of the amplitudes
  std::vector<Stacked> y, columns;  // of the fitted runs
  NormalEquations equations;
};

Fit fit_amplitudes(const MixedModel& model, const Components& y, const std::vector<const Components*>& items,
                   const NullFit& null) {
  const Index k = static_cast<Index>(items.size());
  Fit fit{VectorXd::Zero(k), MatrixXd::Zero(k, k), {}, {}, {}};
  NormalEquations& e = fit.equations = {MatrixXd::Zero(k, k), VectorXd::Zero(k), VectorXd::Zero(k)};
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    fit.y.push_back(model.stack(s, {&y}));
    fit.columns.push_back(model.stack(s, items));
    if (k == 0) continue;
    Stacked projected_y = fit.y[s], projected = fit.columns[s];
    model.project(s, null.ratio[s], projected_y);
    model.project(s, null.ratio[s], projected);
    const double weight = weight_of(null.sigma[s]);
    e.a += weight * projected.transpose() * projected;
    e.b += weight * projected.transpose() * projected_y.col(0);
    e.plain += weight * fit.columns[s].colwise().squaredNorm().transpose();
  }
  if (k == 0) return fit;
  // Collinear columns share their amplitude instead of running away.
  const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(e.a);
  fit.amplitude = solver.solve(e.b);
  fit.covariance = solver.pseudoInverse();
  return fit;
}

/// Directions of the amplitudes that the fitted runs say nothing of, k × directions: a column that the
/// baseline has in it there, or that is 0 there, and sums of columns that cancel there. `plain`: the columns'
/// squares over the runs to predict; along a direction a run there changes by 1 at most.
MatrixXd undetermined(const NormalEquations& e, const VectorXd& plain) {
  constexpr double kAbsorbed = 1e-20, kCollinear = 1e-14;  // shares of squares that are rounding
  const VectorXd whole = e.plain + plain, own = e.a.diagonal();
  const auto absorbed = own.array() <= kAbsorbed * whole.array();
  const VectorXd scale = absorbed.select(0, own.cwiseMax(1e-300).cwiseSqrt().cwiseInverse());
  const VectorXd unit = absorbed.select(whole.cwiseMax(1e-300).cwiseSqrt().cwiseInverse(), scale);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(scale.asDiagonal() * e.a * scale.asDiagonal());
  const Index count = (solver.eigenvalues().array() < kCollinear).count();  // they ascend
  return unit.asDiagonal() * solver.eigenvectors().leftCols(count);
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

/// What one stratum's model says of runs that it has not seen.
struct StratumErrors {
  MatrixXd error, variance;  // runs × modes
  Stacked columns;           // the baseline taken out
};

/// y and the columns of the runs to predict, without a baseline.
struct Plain {
  Stacked y, columns;
};

/// Where whole groups are held out, a group's constant and slopes are fitted to every other run of it; the
/// rest is scored, if there are as many runs as coefficients. `result` came with NaN there because the
/// model has no such group; its variances get what runs scatter, `covariance`, not yet what amplitudes do.
void fit_own_baselines(const Observations& observations, const std::vector<int>& rows,
                       const std::vector<OwnBaseline>& own_groups, const RunCovariance& covariance,
                       const Plain& plain, StratumErrors& result) {
  const MatrixXd design = observations.baseline_columns(rows);
  const Index n = static_cast<Index>(rows.size());
  for (const auto& [fitted, scored] : own_groups) {
    const MatrixXd of_fitted = covariance(fitted, fitted), shared = covariance(scored, fitted);
    const VectorXd weight = covariance.of_runs(fitted).cwiseInverse();
    const MatrixXd x = weight.asDiagonal() * design(fitted, Eigen::all), wanted = design(scored, Eigen::all);
    if (x.rows() < x.cols()) continue;
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(x);
    const MatrixXd share = wanted * solver.pseudoInverse() * weight.asDiagonal();  // of each fitted run
    for (Index mode = 0; mode < result.error.cols(); ++mode) {
      const auto y = plain.y.middleRows(mode * n, n), columns = plain.columns.middleRows(mode * n, n);
      result.error(scored, mode) = y(scored, 0) - share * y(fitted, 0);
      result.columns.middleRows(mode * n, n)(scored, Eigen::all) =
          columns(scored, Eigen::all) - share * columns(fitted, Eigen::all);
    }
    // What a run shares with its neighbours is in the group's own constant as well.
    for (std::size_t m = 0; m < scored.size(); ++m) {
      const auto w = share.row(static_cast<Index>(m));
      result.variance.row(scored[m]).setConstant(covariance({scored[m]}, {scored[m]})(0, 0) -
                                                 2 * w.dot(shared.row(static_cast<Index>(m))) +
                                                 w.dot(w * of_fitted));
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

/// What runs scatter by, over σ.
VectorXd scatter_of(const Observations& observations, const MixedModel::Stratum& stratum,
                    const std::vector<int>& rows) {
  if (stratum.means()) return observations.scatter.of_runs(rows);
  return VectorXd::Ones(static_cast<Index>(rows.size()));
}

StratumErrors errors_of_stratum(const Observations& observations, const MixedModel& model, std::size_t s,
                                const Fit& fit, const NullFit& null, Plain plain,
                                const std::vector<int>& rows, const std::vector<OwnBaseline>& own_groups) {
  const MixedModel::Stratum& stratum = model.strata()[s];
  const Index n = static_cast<Index>(rows.size());
  const double sigma = null.sigma[s], ratio = kRatios[null.ratio[s]];
  const VectorXd scatter = scatter_of(observations, stratum, rows);
  Stacked residual = plain.y - model.baseline_prediction(s, null.ratio[s], fit.y[s], rows);
  StratumErrors result{{}, {}, plain.columns};
  if (plain.columns.cols() > 0) {
    result.columns -= model.baseline_prediction(s, null.ratio[s], fit.columns[s], rows);
    residual -= result.columns * fit.amplitude;
    plain.y -= plain.columns * fit.amplitude;
  }
  result.error = residual.reshaped(n, stratum.modes);
  const VectorXd variance =
      sigma * sigma *
      (scatter.array().square() + ratio + model.baseline_variance(s, null.ratio[s], rows).array());
  result.variance = variance.replicate(1, stratum.modes);
  if (stratum.means() && !own_groups.empty())
    fit_own_baselines(observations, rows, own_groups,
                      RunCovariance(observations, rows, scatter, sigma, ratio, model.run_correlation(s)),
                      plain, result);
  if (plain.columns.cols() > 0) {
    const Stacked& x = result.columns;
    result.variance +=
        ((x * fit.covariance).array() * x.array()).rowwise().sum().matrix().reshaped(n, stratum.modes);
  }
  return result;
}

/// Takes the errors of the runs on which an effect acts whose amplitude the fitted runs leave undetermined:
/// in its place would stand what the columns were linearised at, in which these runs have had their part.
/// Whether there are such.
bool remove_unpredictable(const MixedModel& model, const NullFit& null, const Fit& fit,
                          const std::vector<Plain>& plain, std::vector<StratumErrors>& strata) {
  constexpr double kRounding = 1e-6;
  if (fit.amplitude.size() == 0) return false;
  VectorXd squares = VectorXd::Zero(fit.amplitude.size());
  for (std::size_t s = 0; s < strata.size(); ++s)
    squares += weight_of(null.sigma[s]) * plain[s].columns.colwise().squaredNorm().transpose();
  const MatrixXd directions = undetermined(fit.equations, squares);
  if (directions.cols() == 0) return false;
  Eigen::Array<bool, Eigen::Dynamic, 1> unknown =
      Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(strata.front().error.rows(), false);
  for (std::size_t s = 0; s < strata.size(); ++s) {
    const double weight = std::sqrt(weight_of(null.sigma[s]));
    const VectorXd largest = weight * (strata[s].columns * directions).cwiseAbs().rowwise().maxCoeff();
    unknown = unknown ||
              (largest.reshaped(unknown.size(), model.strata()[s].modes).array() > kRounding).rowwise().any();
  }
  for (StratumErrors& stratum : strata)
    for (Index mode = 0; mode < stratum.error.cols(); ++mode)
      stratum.error.col(mode) = unknown.select(kNaN, stratum.error.col(mode).array());
  return unknown.any();
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
  return {fit.amplitude, fit.covariance, fit.equations.a};
}

Components combined(std::span<const Components> columns, const VectorXd& amplitude) {
  Components result = columns.front();
  for (MatrixXd& component : result) component *= amplitude(0);
  for (std::size_t c = 1; c < columns.size(); ++c)
    for (std::size_t k = 0; k < result.size(); ++k)
      result[k] += amplitude(static_cast<Index>(c)) * columns[c][k];
  return result;
}

Components left_beside(const Observations& observations, Components y, const std::vector<Components>& columns,
                       const NullFit& null, const std::vector<int>& rows) {
  if (columns.empty()) return y;
  const Components made = combined(columns, fit_amplitudes(observations, y, columns, null, rows).amplitude);
  for (std::size_t k = 0; k < y.size(); ++k) y[k] -= made[k];
  return y;
}

HeldOutErrors predict_held_out(const Observations& observations, const Components& y,
                               const std::vector<Components>& columns, const NullFit& null,
                               const std::vector<int>& fit_rows, const std::vector<int>& test_rows) {
  const MixedModel model(observations, fit_rows, null.ratio);
  const MixedModel test = MixedModel::baseline_alone(observations, test_rows);
  const std::vector<const Components*> items = pointers_to(columns);
  const Fit fit = fit_amplitudes(model, y, items, null);
  const std::vector<OwnBaseline> own_groups = own_baselines(observations, fit_rows, test_rows);
  std::vector<Plain> plain;
  std::vector<StratumErrors> strata;
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    plain.push_back({test.stack(s, {&y}), test.stack(s, items)});
    strata.push_back(
        errors_of_stratum(observations, model, s, fit, null, plain.back(), test_rows, own_groups));
  }
  const bool undetermined = remove_unpredictable(model, null, fit, plain, strata);
  const Index n = static_cast<Index>(test_rows.size()), c = observations.channels();
  std::vector<VectorXd> parts;
  MatrixXd error_by_mode = MatrixXd::Zero(n, c), variance_by_mode = MatrixXd::Zero(n, c);
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    const MixedModel::Stratum& stratum = model.strata()[s];
    parts.push_back(whitened(observations, test_rows, strata[s].error,
                             scatter_of(observations, stratum, test_rows), null.sigma[s],
                             kRatios[null.ratio[s]], model.run_correlation(s)));
    if (!stratum.means()) continue;
    error_by_mode.middleCols(stratum.first_mode, stratum.modes) = strata[s].error;
    variance_by_mode.middleCols(stratum.first_mode, stratum.modes) = strata[s].variance;
  }
  HeldOutErrors result{test_rows, {}, {}, concatenated(parts), fit.amplitude, undetermined};
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

}  // namespace tunnelrig
