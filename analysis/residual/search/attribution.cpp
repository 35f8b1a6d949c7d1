#include "analysis/residual/likelihood/candidates.h"
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/search.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

Search::Search(const Observations& observations, const std::vector<int>& rows,
               const std::vector<const Effect*>& effects, const SearchSettings& settings)
    : whole_(observations), data_(observations, rows, effects, settings) {}

Attribution Search::run() {
  begin();
  add_effects();
  CurveScan curves = scan_curves();
  const auto begin_again = [&] {
    if (!begin_with_scatter_of(curves)) return false;
    add_effects();
    curves = scan_curves();
    return true;
  };
  // Once more where rotors differ: what was found while they were taken to be alike may have been scatter.
  if (begin_again() && data_.observations().scatter.rotors_differ()) begin_again();
  add_curves(curves);
  find_confounded();
  smooth_curves();
  measure_gains();
  forget_what_has_a_name();
  result_.session_unknown = session_scatter_is_large();
  result_.accepted = std::move(found_.accepted);
  result_.curves = std::move(found_.curves);
  result_.beyond_bounds = std::move(found_.beyond_bounds);
  result_.final = std::move(found_.fit);
  result_.observations = data_.observations();
  result_.observations.value = whole_.value;
  result_.observations.y = whole_.y;
  result_.observations.shape = whole_.shape;
  return std::move(result_);
}

StructureLeft Search::run_on_top_of(const Attribution& found, const JointFit& whole) {
  found_ = {.fit = {}, .accepted = found.accepted, .curves = found.curves};
  found_.set_fit(whole);
  questions_ = kDrawsOnAllRuns;  // other data sets than the search before has drawn
  StructureLeft left;
  for (std::size_t t = 0; t < found_.accepted.size(); ++t)
    if (bends_away(t)) left.bent.insert(t);
  // Of single rows the seal leaves plenty, and what `hold_out` declares is not to be seen by any search.
  const bool few = !data_.observations().blocks_are_rows && data_.observations().held_out.empty();
  const std::size_t before = found_.curves.size();
  while (few && static_cast<int>(found_.curves.size()) < data_.settings().most_curves) {
    const JointFit without = found_.fit;
    if (!add_best_curve(scan_curves())) break;
    for (std::size_t t = 0; t < found_.accepted.size(); ++t)
      if (!found_.accepted[t].term.per_group && outshone_by_curve(found_.accepted[t].term))
        left.bent.insert(t);
    name_newest_curve(without);
  }
  smooth_curves(before);
  left.curves = {found_.curves.begin() + static_cast<std::ptrdiff_t>(before), found_.curves.end()};
  left.fit = std::move(found_.fit);
  left.rounds = std::move(result_.curve_rounds);
  return left;
}

void Search::begin_with(RunScatter scatter) {
  data_.begin_with(std::move(scatter));
  begin();
}

void Search::begin() {
  found_ = {};
  found_.fit = fit_jointly(data_.observations(), {}, data_.rows());
  result_ = {};
  result_.baseline = found_.fit;
  result_.detectable_sigma = detectable_by_one(data_.mixed(), found_.fit.variances, data_.settings().alpha);
}

OwnEvidence::OwnEvidence(const Observations& observations, const MixedModel& baseline)
    : observations_(observations),
      baseline_(baseline),
      predicted_(predict_response(observations, {terms_of_theory(observations), {}}, baseline.rows())) {}

bool OwnEvidence::operator()(const Term& way) const {
  return baseline_.sees(respond(way, observations_, predicted_).derivative[0]);
}

std::optional<Eigen::Index> OwnEvidence::undefined(const Term& way) const {
  const Eigen::MatrixXd column = respond(way, observations_, predicted_).derivative[0][0];
  for (Eigen::Index row = 0; row < column.rows(); ++row)
    if (!column.row(row).allFinite()) return row;
  return {};
}

std::vector<Term> all_ways(const std::vector<const Effect*>& effects, const Observations& observations,
                           const std::vector<int>& rows) {
  std::vector<Term> ways;
  for (const Effect* effect : effects) {
    if (!testability(*effect, observations).ok()) continue;
    for (Term& way : ways_to_try(*effect, observations, rows)) ways.push_back(std::move(way));
  }
  return ways;
}

double detectable_by_one(const MixedModel& mixed, const NullFit& variances, double alpha) {
  const Eigen::RowVectorXd of_all = mixed.mode_matrix().colwise().sum();
  double information = 0;
  for (std::size_t s = 0; s < mixed.strata().size(); ++s) {
    const MixedModel::Stratum& stratum = mixed.strata()[s];
    if (!stratum.means()) continue;
    const double runs = static_cast<double>(std::max<Eigen::Index>(mixed.dof(s) / stratum.modes, 1));
    information += runs * of_all.segment(stratum.first_mode, stratum.modes).squaredNorm() /
                   (std::pow(variances.sigma[s], 2) * (1 + kRatios[variances.ratio[s]]));
  }
  constexpr double kPower = 0.8;
  return (normal_quantile(1 - alpha / 2) + normal_quantile(kPower)) / std::sqrt(information);
}

Attribution attribute(const Observations& observations, const std::vector<int>& rows,
                      const std::vector<const Effect*>& effects, const SearchSettings& settings) {
  return Search(observations, rows, effects, settings).run();
}

StructureLeft structure_left(const Attribution& found, const JointFit& whole, const std::vector<int>& rows,
                             const std::vector<const Effect*>& effects, const SearchSettings& settings) {
  return Search(found.observations, rows, effects, settings).run_on_top_of(found, whole);
}

}  // namespace tunnelrig
