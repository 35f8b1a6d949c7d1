// What runs scatter like, beside what the search has found so far; and the search begun again with it.
#include "analysis/residual/contrast_scatter.h"
#include "analysis/residual/rotor_scatter.h"
#include "analysis/residual/rotor_sessions.h"
#include "analysis/residual/run_correlation.h"
#include "analysis/residual/search.h"

#include <cmath>

namespace tunnelrig {
namespace {

bool are_alike(const Eigen::VectorXd& scatter, const Eigen::VectorXd& other) {
  constexpr double kAlike = 0.05;
  return scatter.size() == other.size() &&
         (scatter.size() == 0 || (scatter.cwiseQuotient(other).array().log().abs() < kAlike).all());
}

}  // namespace

Search::ScatterBeside Search::scatter_beside(const CurveScan& curves, double least_evidence,
                                             std::mt19937_64& random) const {
  const Components y = difference(y_, fit_.linear.offset);
  const Eigen::MatrixXd predicted = predict_response(observations_, fit_.model, rows_);
  const auto beside = [&](const std::vector<Components>& columns) {
    return ScatterBeside{columns, condition_scatter(observations_, rows_, y, columns, predicted, random)};
  };
  // Less ½ ln n for each column and condition.
  const auto likelihood = [&](const ScatterBeside& of) {
    const auto parameters = static_cast<double>(of.columns.size() + of.scatter.by_condition.names.size());
    return of.scatter.variances.log_likelihood - parameters * std::log(static_cast<double>(rows_.size())) / 2;
  };
  ScatterBeside alone = beside(fit_.linear.columns);
  if (curves.tried.empty() || curves.scan.fits[curves.scan.order[0]].evidence < least_evidence) return alone;
  std::vector<Components> columns = fit_.linear.columns;
  const auto& best = curves.tried[curves.scan.order[0]].columns;
  columns.insert(columns.end(), best.begin(), best.end());
  ScatterBeside with = beside(columns);
  // A curve may be the scatter of a few runs far out on a condition, and scatter a curve.
  const bool is_scatter = !alone.scatter.by_condition.names.empty() && likelihood(alone) > likelihood(with);
  return is_scatter ? alone : with;
}

bool Search::begin_with_scatter_of(const CurveScan& curves) {
  const RunScatter& before = observations_.scatter;
  const bool known = before.rotors_differ();
  std::mt19937_64 random(settings_.seed * 1000003 + 3000), other(settings_.seed * 1000003 + 4000),
      third(settings_.seed * 1000003 + 5000), fourth(settings_.seed * 1000003 + 6000),
      fifth(settings_.seed * 1000003 + 7000);
  // While a rotor that scatters more was taken for one like the others, the best curve had a part of its
  // scatter.
  const ScatterBeside beside = scatter_beside(curves, known ? critical_ : 0, third);
  const std::vector<Components>& columns = beside.columns;
  const Components y = difference(y_, fit_.linear.offset);
  Observations scattered = observations_;
  RunScatter& scatter = scattered.scatter = {.by_condition = beside.scatter.by_condition};
  const auto left_beside = [&](const std::vector<Components>& of) {
    return without(y, of, fit_amplitudes(scattered, y, of, beside.scatter.variances, rows_).amplitude);
  };
  const Components residual = left_beside(columns);
  // Rotors that scatter in pairs are not told from such as scatter alone by each one's own scatter.
  const Eigen::VectorXd contrasts = contrast_scatter(scattered, rows_, residual, fifth);
  if (contrasts.size() == 0) scatter.rotors = rotor_scatter(scattered, rows_, residual, other);
  const MixedModel model(scattered, rows_);
  const NullFit variances = CandidateScan(model, columns, {}).null_fit(y);
  scatter.run_correlation = run_correlation(model, variances, residual, random);
  scatter.runs = run_scatter(observations_, run_sizes(model, variances, y, columns, third));
  // The best of many curves makes half of what a dozen sessions differ by, whatever that is.
  if (contrasts.size() == 0)
    scatter.sessions = rotor_sessions(scattered, rows_, left_beside(fit_.linear.columns), fourth);
  scatter.contrasts = contrasts;  // after what takes the differences for one stratum
  if (are_alike(scatter.rotors, before.rotors) && are_alike(contrasts, before.contrasts) &&
      scatter.sessions.rotors == before.sessions.rotors &&
      (before.runs.size() > 0) == (scatter.runs.size() > 0) &&
      before.by_condition.names == scatter.by_condition.names &&
      (known || scatter.run_correlation == before.run_correlation))
    return false;
  observations_.scatter = scatter;
  begin();
  return true;
}

}  // namespace tunnelrig
