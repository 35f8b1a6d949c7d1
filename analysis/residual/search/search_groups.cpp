// An effect whose amplitude is each group's own.
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/search.h"
#include "analysis/residual/search/shape_profile.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tunnelrig {

using Eigen::Index;

struct Search::InGroups {
  Observations observations;  // the term's column is a slope of each group's baseline
  JointFit fit;
};

/// Only effects that may have either sign: of the others, what all groups have in common is seen first.
Search::Scan Search::scan_effects_and_groups(const JointFit& base) const {
  Scan scan = list_effects(base);
  if (data_.observations().from_table) {
    add_group_ways(scan);
    add_several_axes(scan);
  } else {
    add_pairs_of_steps(scan);
  }
  rank(base, scan);
  return scan;
}

void Search::add_group_ways(Scan& scan) const {
  constexpr std::size_t kMostGroups = 24;
  const std::vector<int> groups = groups_among(data_.observations(), data_.rows());
  if (groups.size() < 2 || groups.size() > kMostGroups) return;
  const std::size_t alike = scan.ways.size();
  for (std::size_t i = 0; i < alike; ++i) {
    const auto& parameters = scan.ways[i].effect->parameters;
    if (goes_by_the_law_alone(*scan.ways[i].effect, data_.observations())) continue;
    if (parameters.size() > 1 || parameters[0].theory || parameters[0].lower >= 0 || parameters[0].upper <= 0)
      continue;
    Candidate own{.columns = columns_by_group(scan.candidates[i].columns[0], data_.observations(), groups,
                                              data_.mixed()),
                  .sign = 0,
                  .weight = kWeightInGroups};
    if (own.columns.size() < 2) continue;
    scan.ways.push_back(scan.ways[i]);
    scan.ways.back().per_group = true;
    scan.candidates.push_back(std::move(own));
  }
}

Search::InGroups Search::fit_in_groups(Term term, MeanModel model) const {
  term.per_group = true;
  term.at_theory = false;
  term.parameters[0] = 0;
  InGroups own{data_.observations(), {}};
  const TermResponse response = respond(
      term, data_.observations(), predict_response(data_.observations(), found_.fit.model, data_.rows()));
  Eigen::MatrixXd& slopes = own.observations.slopes;
  slopes.conservativeResize(Eigen::NoChange, slopes.cols() + 1);
  slopes.rightCols(1) = response.derivative[0][0];
  Eigen::MatrixXd& beyond = own.observations.beyond;
  beyond.conservativeResize(slopes.rows(), beyond.cols() + 1);
  beyond.rightCols(1).setZero();
  model.terms.push_back(std::move(term));
  own.fit = fit_in_turns(own.observations, model, data_.rows());
  return own;
}

bool Search::are_better(const InGroups& own, bool before_others) const {
  const JointFit& fit = own.fit;
  if (!fit.at_bound.empty()) return false;
  const CrossValidation after = unseen(own.observations, fit, fit.variances);
  const CrossValidation before = unseen(found_.fit, fit.variances);
  const LossDifference gain = compare(before, after);
  if (!(gain.mean > gain.standard_error) ||
      !groups_within_bounds(own.observations, fit, fit.model.terms.size() - 1))
    return false;
  return !before_others || !another_does_as_well(after, fit.variances);
}

void Search::take(InGroups own) {
  const std::size_t t = own.fit.model.terms.size() - 1;
  for (const std::size_t k : shapes_in_groups(own.fit.model.terms[t])) {
    const double value = shape_profile(own.observations, own.fit, t, k, data_.rows()).likeliest;
    Observations moved = own.observations;
    JointFit there = fit_with_parameter(k, value, moved, own.fit.model, t, data_.rows());
    if (likelihood_beside_own(moved, there.variances, data_.rows()) >
        likelihood_beside_own(own.observations, own.fit.variances, data_.rows()))
      own = {std::move(moved), std::move(there)};
  }
  data_.set_observations(std::move(own.observations));
  found_.set_fit(at_best_run(std::move(own.fit), 1));
}

bool Search::let_groups_differ(std::size_t t, bool before_others) {
  if (!data_.observations().from_table || data_.observations().groups() < 2) return false;
  const Term term = found_.accepted[t].term;
  if (term.per_group || term.effect->theory_only || goes_by_the_law_alone(*term.effect, data_.observations()))
    return false;
  InGroups own = fit_in_groups(term, found_.fit.model.without_term(t));
  if (p_of_groups(data_.observations(), found_.fit, own.observations, own.fit) > data_.settings().alpha ||
      !are_better(own, before_others))
    return false;
  found_.make_newest(t, own.fit);
  take(std::move(own));
  return true;
}

bool Search::let_any_differ() {
  std::size_t t = found_.accepted.size();
  while (t > 0 && !let_groups_differ(t - 1, false)) --t;
  if (t == 0) return false;
  // What was found later may have been what the groups differ by.
  for (std::size_t k = found_.accepted.size(); k-- > t - 1;) {
    const Term term = found_.accepted[k].term;
    if (term.per_group || term.effect->theory_only) continue;
    if (const JointFit without = fit_without(k); !is_still_found(term, without)) found_.drop(k, without);
  }
  return true;
}

bool Search::accept_in_groups(const Term& way, double p) {
  InGroups own = fit_in_groups(way, found_.fit.model);
  if (!are_better(own, true)) return false;
  found_.accept({.term = own.fit.model.terms.back(), .p = p, .confounded = {}}, own.fit);
  take(std::move(own));
  return true;
}

std::size_t Search::alike_instead(const Scan& scan, std::size_t i) const {
  if (!scan.ways[i].per_group) return i;
  for (const std::size_t other : scan.order)
    if (scan.ways[other].effect == scan.ways[i].effect && !scan.ways[other].per_group &&
        scan.fits[other].evidence >= found_.critical)
      return other;
  return i;
}

bool Search::another_does_as_well(const CrossValidation& own, const NullFit& variances) const {
  constexpr std::size_t kTried = 5;
  if (static_cast<int>(found_.accepted.size()) >= data_.settings().most_effects) return false;
  const Scan scan = scan_effects(found_.fit);
  std::vector<std::string> tried;
  for (const std::size_t i : scan.order) {
    const std::string name = scan.ways[i].label();
    if (scan.fits[i].evidence < found_.critical || tried.size() == kTried) break;
    if (std::find(tried.begin(), tried.end(), name) != tried.end()) continue;
    tried.push_back(name);
    const JointFit fit = fit_with(scan.ways[i], scan.fits[i].amplitude(0));
    if (!fit.at_bound.empty()) continue;
    const CrossValidation with_both = unseen(fit, variances);
    // A step chooses its place among all: it must do better.
    const bool as_well = scan.ways[i].effect->has_change_point() ? compare(own, with_both).told_apart()
                                                                 : !compare(with_both, own).told_apart();
    if (as_well) return true;
  }
  return false;
}

bool Search::groups_within_bounds(const Observations& wider, const JointFit& fit, std::size_t t) const {
  return are_within_bounds(estimate_by_group(wider, fit.model, t, fit.variances, data_.rows()),
                           fit.model.terms[t].effect->parameters[0]);
}

double Search::p_of_groups(const Observations& fewer, const JointFit& without, const Observations& wider,
                           const JointFit& with) const {
  // What groups differ by may look like sessions that differ: both by the sessions that the wider model
  // leaves.
  const auto before = sum_of_squares(fewer, without, with.variances),
             after = sum_of_squares(wider, with, with.variances);
  const double more = before.second - after.second;
  if (more <= 0 || after.second <= 0) return 1;
  const double f = (before.first - after.first) / more / (after.first / after.second);
  return f > 0 ? f_upper_p(f, more, after.second) : 1;
}

std::pair<double, double> Search::sum_of_squares(const Observations& observations, const JointFit& fit,
                                                 const NullFit& variances) const {
  const MixedModel mixed(observations, data_.rows(), variances.ratio);
  const Components y = difference(data_.y(), fit.linear.offset);
  const Components left =
      without(y, fit.linear.columns,
              fit_amplitudes(observations, y, fit.linear.columns, variances, data_.rows()).amplitude);
  Stacked stacked = mixed.stack(0, {&left});
  mixed.project(0, variances.ratio[0], stacked);
  const double dof = static_cast<double>(mixed.dof(0) - static_cast<Index>(fit.linear.columns.size()));
  return {stacked.squaredNorm(), dof};
}

}  // namespace tunnelrig
