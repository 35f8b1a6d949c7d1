// What runs scatter like, beside what the search has found so far; and the search begun again with it.
#include "analysis/residual/condition_scatter.h"
#include "analysis/residual/rotor_scatter.h"
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

Search::ScatterBeside Search::scatter_by_condition(std::vector<Components> columns,
                                                   std::mt19937_64& random) const {
  // While calm runs count no more than others, what is left of them has a part of theirs: in steps.
  constexpr int kMostSteps = 8;
  const Components y = difference(y_, fit_.linear.offset);
  const Eigen::MatrixXd predicted = predict_response(observations_, fit_.model, rows_);
  Observations scattered = observations_;
  scattered.scatter = {};
  ScatterBeside result{std::move(columns), {}, 0};
  for (int step = 0; step < kMostSteps; ++step) {
    const MixedModel model(scattered, rows_);
    const NullFit variances = CandidateScan(model, result.columns, {}).null_fit(y);
    const double parameters =
        static_cast<double>(result.columns.size() + scattered.scatter.by_condition.names.size());
    result.log_likelihood =
        variances.log_likelihood - parameters * std::log(static_cast<double>(rows_.size())) / 2;
    result.by_condition = scattered.scatter.by_condition;
    if (!let_scatter_differ(observations_, run_sizes(model, variances, y, result.columns, random), predicted,
                            random, scattered.scatter.by_condition))
      break;
  }
  return result;
}

Search::ScatterBeside Search::scatter_beside(const CurveScan& curves, double least_evidence,
                                             std::mt19937_64& random) const {
  ScatterBeside without = scatter_by_condition(fit_.linear.columns, random);
  if (curves.tried.empty() || curves.scan.fits[curves.scan.order[0]].evidence < least_evidence)
    return without;
  std::vector<Components> columns = fit_.linear.columns;
  const auto& best = curves.tried[curves.scan.order[0]].columns;
  columns.insert(columns.end(), best.begin(), best.end());
  ScatterBeside with = scatter_by_condition(std::move(columns), random);
  // A curve may be the scatter of a few runs far out on a condition, and scatter a curve.
  const bool is_scatter = !without.by_condition.names.empty() && without.log_likelihood > with.log_likelihood;
  return is_scatter ? without : with;
}

bool Search::begin_with_scatter_of(const CurveScan& curves) {
  const RunScatter& before = observations_.scatter;
  const bool known = before.rotors.size() > 0;
  std::mt19937_64 random(settings_.seed * 1000003 + 3000), other(settings_.seed * 1000003 + 4000),
      third(settings_.seed * 1000003 + 5000);
  // While a rotor that scatters more was taken for one like the others, the best curve had a part of its
  // scatter.
  const ScatterBeside beside = scatter_beside(curves, known ? critical_ : 0, third);
  const std::vector<Components>& columns = beside.columns;
  const Components y = difference(y_, fit_.linear.offset);
  Observations scattered = observations_;
  RunScatter& scatter = scattered.scatter = {.by_condition = beside.by_condition};
  const auto variances_of = [&](const MixedModel& model) {
    return CandidateScan(model, columns, {}).null_fit(y);
  };
  Components residual = y;
  const AmplitudeFit fit =
      fit_amplitudes(scattered, y, columns, variances_of(MixedModel(scattered, rows_)), rows_);
  for (std::size_t c = 0; c < columns.size(); ++c)
    for (std::size_t j = 0; j < residual.size(); ++j)
      residual[j] -= fit.amplitude(static_cast<Eigen::Index>(c)) * columns[c][j];
  scatter.rotors = rotor_scatter(scattered, rows_, residual, other);
  const MixedModel model(scattered, rows_);
  const NullFit variances = variances_of(model);
  scatter.run_correlation = run_correlation(model, variances, residual, random);
  scatter.runs = run_scatter(observations_, run_sizes(model, variances, y, columns, third));
  if (are_alike(scatter.rotors, before.rotors) && (before.runs.size() > 0) == (scatter.runs.size() > 0) &&
      before.by_condition.names == scatter.by_condition.names &&
      (known || scatter.run_correlation == before.run_correlation))
    return false;
  observations_.scatter = scatter;
  begin();
  return true;
}

}  // namespace tunnelrig
