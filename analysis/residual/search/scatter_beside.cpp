#include "analysis/residual/search/scatter_beside.h"

#include "analysis/residual/scatter/condition_scatter.h"
#include "analysis/residual/scatter/contrast_scatter.h"
#include "analysis/residual/scatter/rotor_scatter.h"
#include "analysis/residual/scatter/rotor_sessions.h"
#include "analysis/residual/scatter/run_correlation.h"
#include "analysis/residual/search/curve_scan.h"
#include "analysis/residual/search/draws.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/unseen.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {
namespace {

bool are_alike(const Eigen::VectorXd& scatter, const Eigen::VectorXd& other) {
  constexpr double kAlike = 0.05;
  return scatter.size() == other.size() &&
         (scatter.size() == 0 || (scatter.cwiseQuotient(other).array().log().abs() < kAlike).all());
}

struct ScatterBeside {
  std::vector<Components> columns;
  ScatterFit scatter;
};

const Curve& best_of(const CurveScan& curves) { return curves.tried[curves.scan.order[0]]; }

/// Of all curves the one that does the most where its own columns stand beside the same times the scatter, or
/// beside its first one in each group alone: what a condition does where another one, with which the scatter
/// goes, lets it, or in a group. None: empty.
std::vector<Components> columns_that_go_with(const Eigen::VectorXd& scatter, const SearchData& data,
                                             const Found& found, const CurveScan& curves) {
  std::vector<Candidate> candidates;
  for (const Curve& curve : curves.tried) {
    if (curve.rotor >= 0 || !curve.everywhere()) continue;
    Candidate& both = candidates.emplace_back(as_candidate(curve));
    for (Components times : curve.columns) {
      for (Eigen::MatrixXd& component : times) component = scatter.asDiagonal() * component;
      both.columns.push_back(std::move(times));
    }
  }
  const std::vector<int> groups = groups_among(data.observations(), data.rows());
  for (const Curve& curve : curves.tried)
    if (curve.rotor < 0 && curve.everywhere() && groups.size() > 1 && groups.size() <= kMostGroups)
      candidates.push_back(
          {.columns = columns_by_group(curve.columns[0], data.observations(), groups, data.mixed()),
           .sign = 0});
  if (candidates.empty()) return {};
  const auto fits = CandidateScan(data.mixed(), found.fit.linear.columns, candidates)
                        .fit(difference(data.y(), found.fit.linear.offset));
  const double of_column = std::log(static_cast<double>(data.rows().size())) / 2;
  std::size_t best = 0;
  const auto worth = [&](std::size_t i) {
    return fits[i].likelihood_ratio - of_column * static_cast<double>(candidates[i].columns.size());
  };
  for (std::size_t i = 1; i < fits.size(); ++i)
    if (worth(i) > worth(best)) best = i;
  return columns_with(found.fit, candidates[best].columns);
}

/// Beside the model and the best curve, if that has this evidence; or without the curve, where scatter is
/// likelier than that, and than what several curves do together.
ScatterBeside scatter_beside(const SearchData& data, const Found& found, const CurveScan& curves,
                             double least_evidence, std::mt19937_64& random) {
  const Components y = difference(data.y(), found.fit.linear.offset);
  const Eigen::MatrixXd predicted = predict_response(data.observations(), found.fit.model, data.rows());
  const auto beside = [&](const std::vector<Components>& columns) {
    return ScatterBeside{columns,
                         condition_scatter(data.observations(), data.rows(), y, columns, predicted, random)};
  };
  // Less ½ ln n for each column and condition.
  const auto likelihood = [&](const ScatterBeside& of) {
    const auto parameters = static_cast<double>(of.columns.size() + of.scatter.by_condition.names.size());
    return of.scatter.variances.log_likelihood -
           parameters * std::log(static_cast<double>(data.rows().size())) / 2;
  };
  ScatterBeside alone = beside(found.fit.linear.columns);
  if (curves.tried.empty() || curves.scan.fits[curves.scan.order[0]].evidence < least_evidence) return alone;
  ScatterBeside with = beside(columns_with(found.fit, best_of(curves).columns));
  if (alone.scatter.by_condition.names.empty()) return with;
  // A curve may be the scatter of a few runs far out on a condition, and scatter a curve.
  ScatterBeside best = likelihood(alone) > likelihood(with) ? alone : std::move(with);
  double most = likelihood(best);
  // What acts in a part of the runs only is a scatter to any single curve.
  const double of_choice = std::log(static_cast<double>(curves.tried.size()));
  constexpr int kMostCurves = 3;
  Found further = found;
  CurveScan next;
  const CurveScan* scan = &curves;
  for (int k = 1; k < kMostCurves && !best.scatter.by_condition.names.empty(); ++k) {
    const Curve& last = best_of(*scan);
    further.add_curve({.curve = last, .instead_of = {}}, fit_with_curve(data, further.fit, last));
    next = scan_curves(data, further);
    scan = &next;
    if (next.tried.empty()) break;
    ScatterBeside more = beside(columns_with(further.fit, best_of(next).columns));
    const double of_more = likelihood(more) - k * of_choice;
    if (of_more <= most) continue;
    best = std::move(more);
    most = of_more;
  }
  if (best.scatter.by_condition.names.empty()) return best;
  const auto in_a_part = columns_that_go_with(alone.scatter.by_condition.runs, data, found, curves);
  if (in_a_part.empty()) return best;
  ScatterBeside more = beside(in_a_part);
  if (likelihood(more) - of_choice <= most) return best;
  // What is left of a shape that these columns only resemble is no scatter to weigh by: that would hide it.
  more.scatter = {.by_condition = {}, .variances = CandidateScan(data.mixed(), more.columns, {}).null_fit(y)};
  return more;
}

/// Of single rotors over one condition, those that explain the most together; none where chance does as much.
std::vector<Curve> of_each_rotor(const CurveScan& curves) {
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

/// Parts of a total do not.
bool rotors_differ(const Components& residual, const std::vector<int>& rows) {
  constexpr double kRounding = 1e-9;
  const Eigen::MatrixXd means = residual[0](rows, Eigen::all);
  return (means.colwise() - means.rowwise().mean()).norm() > kRounding * means.norm();
}

}  // namespace

std::optional<RunScatter> other_scatter_beside(const SearchData& data, const Found& found,
                                               const CurveScan& curves) {
  const RunScatter& before = data.observations().scatter;
  const bool known = before.rotors_differ();
  const std::uint64_t seed = data.settings().seed;
  std::mt19937_64 for_correlation = random_numbers(seed, ScatterDraws::kCorrelation),
                  for_rotors = random_numbers(seed, ScatterDraws::kRotors),
                  for_runs = random_numbers(seed, ScatterDraws::kRuns),
                  for_sessions = random_numbers(seed, ScatterDraws::kSessions),
                  for_contrasts = random_numbers(seed, ScatterDraws::kContrasts);
  // While a rotor that scatters more was taken for one like the others, the best curve had a part of its
  // scatter.
  const ScatterBeside beside = scatter_beside(data, found, curves, known ? found.critical : 0, for_runs);
  const std::vector<Components>& columns = beside.columns;
  const Components y = difference(data.y(), found.fit.linear.offset);
  Observations scattered = data.observations();
  RunScatter& scatter = scattered.scatter = {.by_condition = beside.scatter.by_condition};
  const auto left = [&](const std::vector<Components>& of) {
    return left_beside(scattered, y, of, beside.scatter.variances, data.rows());
  };
  const Components residual = left(columns);
  // What a condition does to single rotors, or to them in pairs, is no scatter.
  std::vector<Components> with_each_rotor = columns;
  for (const Curve& curve : of_each_rotor(curves))
    with_each_rotor.insert(with_each_rotor.end(), curve.columns.begin(), curve.columns.end());
  const Components of_rotors = left(with_each_rotor);
  // Rotors that scatter in pairs are not told from such as scatter alone by each one's own scatter.
  const bool differ = rotors_differ(of_rotors, data.rows());
  const Eigen::VectorXd contrasts =
      differ ? contrast_scatter(scattered, data.rows(), of_rotors, for_contrasts) : Eigen::VectorXd();
  if (differ && contrasts.size() == 0)
    scatter.rotors = rotor_scatter(scattered, data.rows(), of_rotors, for_rotors);
  const MixedModel model(scattered, data.rows());
  const NullFit variances = CandidateScan(model, columns, {}).null_fit(y);
  scatter.run_correlation = run_correlation(scattered, model, variances, residual, for_correlation);
  scatter.runs = run_scatter(data.observations(), run_sizes(model, variances, y, columns, for_runs));
  // The best of many curves makes half of what a dozen sessions differ by, whatever that is.
  if (differ && contrasts.size() == 0)
    scatter.sessions = rotor_sessions(scattered, data.rows(), left(found.fit.linear.columns), for_sessions);
  scatter.contrasts = contrasts;  // after what takes the differences for one stratum
  if (are_alike(scatter.rotors, before.rotors) && are_alike(contrasts, before.contrasts) &&
      scatter.sessions.rotors == before.sessions.rotors &&
      (before.runs.size() > 0) == (scatter.runs.size() > 0) &&
      before.by_condition.names == scatter.by_condition.names &&
      (known || scatter.run_correlation == before.run_correlation))
    return std::nullopt;
  return std::move(scatter);
}

std::optional<SessionScatter> session_scatter_is_large(const SearchData& data, const JointFit& fit) {
  constexpr double kOneSided = 0.025;  // a lower bound of 95 %
  const RotorSessions& unlike = data.observations().scatter.sessions;
  std::optional<SessionScatter> of_rotor;
  for (std::size_t s = 0; s < data.mixed().strata().size(); ++s) {
    if (!data.mixed().strata()[s].means()) continue;
    double below = 0;
    for (std::size_t r = 0; r < fit.variances.ratio_probability[s].size(); ++r) {
      if (kRatios[r] <= data.settings().session_ratio * data.settings().session_ratio)
        below += fit.variances.ratio_probability[s][r];
    }
    if (below >= kOneSided) continue;
    const Eigen::Index mode = data.mixed().strata()[s].first_mode;  // the first is what all have in common
    const bool own = unlike.rotors.size() == 1 && mode > 0 && mode < unlike.alone;
    if (!own) return SessionScatter{-1, below};
    of_rotor = SessionScatter{unlike.rotors[0], below};
  }
  return of_rotor;
}

}  // namespace tunnelrig
