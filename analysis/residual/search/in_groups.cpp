#include "analysis/residual/search/in_groups.h"

#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/best_run.h"
#include "analysis/residual/search/effect_scan.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/shape_profile.h"
#include "analysis/residual/search/unseen.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {
namespace {

using Eigen::Index;

/// With the effects of `others`.
InGroups fit_in_groups(const SearchData& data, const JointFit& base, Term term, MeanModel others) {
  term.per_group = true;
  term.at_theory = false;
  term.parameters[0] = 0;
  InGroups own{data.observations(), {}};
  const TermResponse response =
      respond(term, data.observations(), predict_response(data.observations(), base.model, data.rows()));
  Eigen::MatrixXd& slopes = own.observations.slopes;
  slopes.conservativeResize(Eigen::NoChange, slopes.cols() + 1);
  slopes.rightCols(1) = response.derivative[0][0];
  Eigen::MatrixXd& beyond = own.observations.beyond;
  beyond.conservativeResize(slopes.rows(), beyond.cols() + 1);
  beyond.rightCols(1).setZero();
  others.terms.push_back(std::move(term));
  own.fit = fit_in_turns(own.observations, others, data.rows());
  return own;
}

/// Of its time constants and lengths those that are likeliest, and of a step the run.
InGroups at_best_values(InGroups own, const std::vector<int>& rows) {
  const std::size_t t = own.fit.model.terms.size() - 1;
  for (const std::size_t k : shapes_in_groups(own.fit.model.terms[t])) {
    const double value = shape_profile(own.observations, own.fit, t, k, rows).likeliest;
    Observations moved = own.observations;
    JointFit there = fit_with_parameter(k, value, moved, own.fit.model, t, rows);
    if (likelihood_beside_own(moved, there.variances, rows) >
        likelihood_beside_own(own.observations, own.fit.variances, rows))
      own = {std::move(moved), std::move(there)};
  }
  Placed placed = at_best_run(own.observations, std::move(own.fit), 1, rows);
  if (placed.observations) own.observations = std::move(*placed.observations);
  own.fit = std::move(placed.fit);
  return own;
}

/// Of the runs' means within the fit, and its degrees of freedom.
std::pair<double, double> sum_of_squares(const SearchData& data, const Observations& observations,
                                         const JointFit& fit, const NullFit& variances) {
  const MixedModel mixed(observations, data.rows(), variances.ratio);
  const Components left = left_beside(observations, difference(data.y(), fit.linear.offset),
                                      fit.linear.columns, variances, data.rows());
  Stacked stacked = mixed.stack(0, {&left});
  mixed.project(0, variances.ratio[0], stacked);
  const double dof = static_cast<double>(mixed.dof(0) - static_cast<Index>(fit.linear.columns.size()));
  return {stacked.squaredNorm(), dof};
}

/// Whether one of the best effects with one amplitude for all groups predicts unseen blocks about as well as
/// amplitudes of the groups' own. `own`: losses of these, by those variances.
bool another_does_as_well(const SearchData& data, const Found& found, const CrossValidation& own,
                          const NullFit& variances) {
  constexpr std::size_t kTried = 5;
  if (static_cast<int>(found.accepted.size()) >= data.settings().most_effects) return false;
  const Scan scan = scan_effects(data, found, found.fit);
  std::vector<std::string> tried;
  for (const std::size_t i : scan.order) {
    const std::string name = scan.ways[i].label();
    if (scan.fits[i].evidence < found.critical || tried.size() == kTried) break;
    if (std::find(tried.begin(), tried.end(), name) != tried.end()) continue;
    tried.push_back(name);
    const JointFit fit = fit_with(data, found.fit, scan.ways[i], scan.fits[i].amplitude(0));
    if (!fit.at_bound.empty()) continue;
    const CrossValidation with_both = unseen(data, fit, variances);
    // A step chooses its place among all: it must do better.
    const bool as_well = scan.ways[i].effect->has_change_point() ? compare(own, with_both).told_apart()
                                                                 : !compare(with_both, own).told_apart();
    if (as_well) return true;
  }
  return false;
}

/// Whether groups that see a step have rows before it: to the others it is an offset, of which no time is
/// known.
bool begins_within_groups(const Observations& observations, const std::vector<int>& rows) {
  const Eigen::VectorXd step = observations.slopes.rightCols<1>();
  return std::ranges::all_of(rows_of_each(observations.group, rows), [&](const auto& group) {
    return std::ranges::any_of(group.second, [&](int row) { return step(row) == 0; });
  });
}

/// Whether they predict unseen blocks better, within the bounds of physics.
bool are_better(const SearchData& data, const Found& found, const InGroups& own, bool before_others) {
  const JointFit& fit = own.fit;
  if (!fit.at_bound.empty()) return false;
  if (fit.model.terms.back().effect->has_change_point() &&
      !begins_within_groups(own.observations, data.rows()))
    return false;
  const CrossValidation after = unseen(data, own.observations, fit, fit.variances);
  const CrossValidation before = unseen(data, found.fit, fit.variances);
  const LossDifference gain = compare(before, after);
  if (!(gain.mean > gain.standard_error) ||
      !groups_within_bounds(data, own.observations, fit, fit.model.terms.size() - 1))
    return false;
  return !before_others || !another_does_as_well(data, found, after, fit.variances);
}

}  // namespace

std::optional<InGroups> let_differ(const SearchData& data, const Found& found, std::size_t t,
                                   bool before_others) {
  const Observations& observations = data.observations();
  if (!observations.from_table || observations.groups() < 2) return std::nullopt;
  const Term& term = found.accepted[t].term;
  if (term.per_group || term.effect->theory_only || goes_by_the_law_alone(*term.effect, observations))
    return std::nullopt;
  InGroups own = fit_in_groups(data, found.fit, term, found.fit.model.without_term(t));
  if (p_of_groups(data, observations, found.fit, own.observations, own.fit) > data.settings().alpha ||
      !are_better(data, found, own, before_others))
    return std::nullopt;
  return at_best_values(std::move(own), data.rows());
}

std::optional<InGroups> new_in_groups(const SearchData& data, const Found& found, const Term& way) {
  InGroups own = fit_in_groups(data, found.fit, way, found.fit.model);
  if (!are_better(data, found, own, true)) return std::nullopt;
  return at_best_values(std::move(own), data.rows());
}

double p_of_groups(const SearchData& data, const Observations& fewer, const JointFit& without,
                   const Observations& wider, const JointFit& with) {
  // What groups differ by may look like sessions that differ: both by the sessions that the wider model
  // leaves.
  const auto before = sum_of_squares(data, fewer, without, with.variances),
             after = sum_of_squares(data, wider, with, with.variances);
  const double more = before.second - after.second;
  if (more <= 0 || after.second <= 0) return 1;
  const double f = (before.first - after.first) / more / (after.first / after.second);
  return f > 0 ? f_upper_p(f, more, after.second) : 1;
}

bool groups_within_bounds(const SearchData& data, const Observations& wider, const JointFit& fit,
                          std::size_t t) {
  return are_within_bounds(estimate_by_group(wider, fit.model, t, fit.variances, data.rows()),
                           fit.model.terms[t].effect->parameters[0]);
}

}  // namespace tunnelrig
