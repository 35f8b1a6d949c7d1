// What runs scatter like, beside what the search has found so far; and the search begun again with it.
#include "analysis/residual/scatter/contrast_scatter.h"
#include "analysis/residual/scatter/rotor_scatter.h"
#include "analysis/residual/scatter/rotor_sessions.h"
#include "analysis/residual/scatter/run_correlation.h"
#include "analysis/residual/search/search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

namespace tunnelrig {
namespace {

bool are_alike(const Eigen::VectorXd& scatter, const Eigen::VectorXd& other) {
  constexpr double kAlike = 0.05;
  return scatter.size() == other.size() &&
         (scatter.size() == 0 || (scatter.cwiseQuotient(other).array().log().abs() < kAlike).all());
}

/// Runs so far off that data sets with them would be made by them alone, the furthest first. `sizes`: rms 1.
std::vector<Eigen::Index> far_runs(const std::vector<Eigen::MatrixXd>& sizes, std::size_t most) {
  constexpr double kFar = 5;
  std::vector<std::pair<double, Eigen::Index>> far;
  for (const Eigen::MatrixXd& of_stratum : sizes)
    for (Eigen::Index run = 0; run < of_stratum.rows(); ++run)
      if (const double size = of_stratum.row(run).maxCoeff(); size > kFar) far.emplace_back(size, run);
  std::sort(far.rbegin(), far.rend());
  std::vector<Eigen::Index> runs;
  for (const auto& [size, run] : far)
    if (runs.size() < most && std::find(runs.begin(), runs.end(), run) == runs.end()) runs.push_back(run);
  return runs;
}

}  // namespace

std::vector<Eigen::MatrixXd> Search::sizes_beside(const JointFit& fit, const Candidate& candidate,
                                                  const CandidateFit& found) const {
  constexpr Eigen::Index kFewest = 20;
  constexpr std::size_t kMostFar = 3;
  if (data_.mixed().dof(0) < kFewest) return {};
  const Components y = difference(data_.y(), fit.linear.offset);
  const auto sizes = [&](const std::vector<Eigen::Index>& as_they_are) {
    return data_.mixed().sizes_left(fit.variances.ratio, fit.variances.sigma, y, candidate.columns,
                                    found.amplitude, as_they_are);
  };
  auto result = sizes({});
  // Where a condition has one value far out, a curve that is only nearly right is far off without that run.
  const std::vector<Eigen::Index> far = far_runs(result, kMostFar);
  return far.empty() || !is_found_without(far, fit, candidate, found) ? result : sizes(far);
}

bool Search::is_found_without(const std::vector<Eigen::Index>& places, const JointFit& fit,
                              const Candidate& candidate, const CandidateFit& found) const {
  constexpr double kMost = 0.7;
  const Eigen::Index channels = data_.y()[0].cols();
  Components nothing;
  for (const Eigen::MatrixXd& component : data_.y())
    nothing.push_back(Eigen::MatrixXd::Zero(component.rows(), component.cols()));
  std::vector<Components> columns = fit.linear.columns;
  for (const Eigen::Index place : places)
    for (Eigen::Index channel = 0; channel < channels; ++channel) {
      columns.push_back(nothing);
      columns.back()[0](data_.rows()[static_cast<std::size_t>(place)], channel) = 1;
    }
  const CandidateScan scan(data_.mixed(), columns, {candidate});
  return scan.fit(difference(data_.y(), fit.linear.offset))[0].evidence > kMost * found.evidence;
}

Search::ScatterBeside Search::scatter_beside(const CurveScan& curves, double least_evidence,
                                             std::mt19937_64& random) const {
  const Components y = difference(data_.y(), found_.fit.linear.offset);
  const Eigen::MatrixXd predicted = predict_response(data_.observations(), found_.fit.model, data_.rows());
  const auto beside = [&](const std::vector<Components>& columns) {
    return ScatterBeside{
        columns, condition_scatter(data_.observations(), data_.rows(), y, columns, predicted, random)};
  };
  // Less ½ ln n for each column and condition.
  const auto likelihood = [&](const ScatterBeside& of) {
    const auto parameters = static_cast<double>(of.columns.size() + of.scatter.by_condition.names.size());
    return of.scatter.variances.log_likelihood -
           parameters * std::log(static_cast<double>(data_.rows().size())) / 2;
  };
  ScatterBeside alone = beside(found_.fit.linear.columns);
  if (curves.tried.empty() || curves.scan.fits[curves.scan.order[0]].evidence < least_evidence) return alone;
  ScatterBeside with = beside(columns_with(curves.tried[curves.scan.order[0]].columns));
  // A curve may be the scatter of a few runs far out on a condition, and scatter a curve.
  const bool is_scatter = !alone.scatter.by_condition.names.empty() && likelihood(alone) > likelihood(with);
  return is_scatter ? alone : with;
}

std::vector<Curve> Search::of_each_rotor(const CurveScan& curves) {
  struct OfRotors {
    double worth = 0;
    std::vector<Curve> curves;
    std::size_t columns() const { return curves[0].columns.size(); }
  };
  using Condition = std::pair<std::string, std::string>;  // and where
  std::map<Condition, std::map<std::pair<CurveShape, std::size_t>, OfRotors>> all;
  std::pair<double, Condition> best;
  for (std::size_t i = 0; i < curves.tried.size(); ++i) {
    const Curve& curve = curves.tried[i];
    if (curve.rotor < 0) continue;
    const Condition condition{curve.covariate, curve.place.name};
    OfRotors& own = all[condition][{curve.shape, curve.columns.size()}];
    own.worth += curves.scan.fits[i].likelihood_ratio - static_cast<double>(curve.columns.size());
    own.curves.push_back(curve);
    best = std::max(best, {own.worth, condition});
  }
  if (!(best.first > 0)) return {};
  // What the best of these shapes is by a little too straight for would be a scatter.
  const auto& shapes = all.at(best.second);
  return std::ranges::max_element(shapes, {}, [](const auto& shape) { return shape.second.columns(); })
      ->second.curves;
}

bool Search::begin_with_scatter_of(const CurveScan& curves) {
  const RunScatter& before = data_.observations().scatter;
  const bool known = before.rotors_differ();
  const std::uint64_t seed = data_.settings().seed;
  std::mt19937_64 for_correlation = random_numbers(seed, ScatterDraws::kCorrelation),
                  for_rotors = random_numbers(seed, ScatterDraws::kRotors),
                  for_runs = random_numbers(seed, ScatterDraws::kRuns),
                  for_sessions = random_numbers(seed, ScatterDraws::kSessions),
                  for_contrasts = random_numbers(seed, ScatterDraws::kContrasts);
  // While a rotor that scatters more was taken for one like the others, the best curve had a part of its
  // scatter.
  const ScatterBeside beside = scatter_beside(curves, known ? found_.critical : 0, for_runs);
  const std::vector<Components>& columns = beside.columns;
  const Components y = difference(data_.y(), found_.fit.linear.offset);
  Observations scattered = data_.observations();
  RunScatter& scatter = scattered.scatter = {.by_condition = beside.scatter.by_condition};
  const auto left_beside = [&](const std::vector<Components>& of) {
    return without(y, of, fit_amplitudes(scattered, y, of, beside.scatter.variances, data_.rows()).amplitude);
  };
  const Components residual = left_beside(columns);
  // What a condition does to single rotors, or to them in pairs, is no scatter.
  std::vector<Components> with_each_rotor = columns;
  for (const Curve& curve : of_each_rotor(curves))
    with_each_rotor.insert(with_each_rotor.end(), curve.columns.begin(), curve.columns.end());
  const Components of_rotors = left_beside(with_each_rotor);
  // Rotors that scatter in pairs are not told from such as scatter alone by each one's own scatter.
  const Eigen::VectorXd contrasts = contrast_scatter(scattered, data_.rows(), of_rotors, for_contrasts);
  if (contrasts.size() == 0) scatter.rotors = rotor_scatter(scattered, data_.rows(), of_rotors, for_rotors);
  const MixedModel model(scattered, data_.rows());
  const NullFit variances = CandidateScan(model, columns, {}).null_fit(y);
  scatter.run_correlation = run_correlation(model, variances, residual, for_correlation);
  scatter.runs = run_scatter(data_.observations(), run_sizes(model, variances, y, columns, for_runs));
  // The best of many curves makes half of what a dozen sessions differ by, whatever that is.
  if (contrasts.size() == 0)
    scatter.sessions =
        rotor_sessions(scattered, data_.rows(), left_beside(found_.fit.linear.columns), for_sessions);
  scatter.contrasts = contrasts;  // after what takes the differences for one stratum
  if (are_alike(scatter.rotors, before.rotors) && are_alike(contrasts, before.contrasts) &&
      scatter.sessions.rotors == before.sessions.rotors &&
      (before.runs.size() > 0) == (scatter.runs.size() > 0) &&
      before.by_condition.names == scatter.by_condition.names &&
      (known || scatter.run_correlation == before.run_correlation))
    return false;
  begin_with(std::move(scatter));
  return true;
}

}  // namespace tunnelrig
