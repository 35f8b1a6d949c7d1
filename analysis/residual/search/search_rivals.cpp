// Effects that do as well as an accepted one.
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/null_maxima.h"
#include "analysis/residual/search/search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

namespace tunnelrig {

using Eigen::Index;

void Search::find_confounded() {
  for (std::size_t t = 0; t < found_.accepted.size(); ++t) {
    Accepted& accepted = found_.accepted[t];
    if (accepted.term.per_group) {
      accepted.confounded = rivals_in_groups(accepted);
      continue;
    }
    const JointFit without = fit_without(t);
    accepted.confounded = rivals(accepted, without, scan_effects(without));
  }
}

std::vector<Ranked> Search::rivals(const Accepted& accepted, const JointFit& without,
                                   const Scan& scan) const {
  std::vector<Ranked> result;
  const Components y = difference(data_.y(), without.linear.offset);
  const Eigen::MatrixXd predicted = predict_response(data_.observations(), without.model, data_.rows());
  const auto validate = [&](const Term& way, const Candidate& candidate) {
    std::vector<Components> columns = without.linear.columns;
    if (way.effect->theory_only) {  // with another amplitude it would be another effect
      Term at_theory = way;
      at_theory.parameters[0] = *way.effect->theory();
      return cross_validate(data_.observations(),
                            difference(y, respond(at_theory, data_.observations(), predicted).value), columns,
                            found_.fit.variances, data_.rows());
    }
    columns.push_back(candidate.columns[0]);
    return cross_validate(data_.observations(), y, columns, found_.fit.variances, data_.rows());
  };
  std::optional<CrossValidation> own;
  for (const std::size_t i : scan.order)
    if (!own && scan.ways[i].effect->cause() == accepted.term.effect->cause() &&
        scan.ways[i].rotor == accepted.term.rotor)
      own = validate(scan.ways[i], scan.candidates[i]);
  if (!own) return result;
  std::vector<std::string> done = {accepted.term.effect->cause()};
  for (const std::size_t i : scan.order) {
    if (scan.fits[i].evidence < found_.critical) break;
    const std::string cause = scan.ways[i].effect->cause();
    if (std::count(done.begin(), done.end(), cause) >= 3) continue;  // three ways of each are tried
    done.push_back(cause);
    if (cause == accepted.term.effect->cause()) continue;
    const bool listed = std::any_of(result.begin(), result.end(),
                                    [&](const Ranked& r) { return r.term.effect->cause() == cause; });
    if (listed || (!scan.ways[i].effect->theory_only && !within_bounds(scan, i))) continue;
    if (compare(validate(scan.ways[i], scan.candidates[i]), *own).told_apart()) continue;
    Term term = scan.ways[i];
    term.parameters[0] = term.effect->theory_only ? *term.effect->theory() : scan.fits[i].amplitude(0);
    // What the others must be beside it is physical as well.
    MeanModel instead = without.model;
    instead.terms.push_back(term);
    instead.terms.back().at_theory = term.effect->theory_only;
    const JointFit fit = fit_jointly(data_.observations(), instead, data_.rows());
    const auto& terms = fit.model.terms;
    if (std::any_of(terms.begin(), std::prev(terms.end()),
                    [&](const Term& each) { return at_bound(fit, each); }))
      continue;
    result.push_back({terms.back(), scan.fits[i].evidence, 0, terms.back().parameters[0], 0});
  }
  return result;
}

bool Search::within_bounds(const Scan& scan, std::size_t i) {
  const EffectParameter& amplitude = scan.ways[i].effect->parameters[0];
  return scan.fits[i].amplitude(0) >= amplitude.lower && scan.fits[i].amplitude(0) <= amplitude.upper;
}

std::vector<Ranked> Search::rivals_in_groups(const Accepted& accepted) const {
  std::vector<Ranked> result;
  std::size_t t = 0;
  while (!found_.fit.model.terms[t].same_way(accepted.term)) ++t;
  const Index own_place = place_among_own(found_.fit.model, t);
  const Index place = data_.observations().first_own_slope() + own_place;
  const Observations fewer = without_own(data_.observations(), found_.fit.model, t);
  const JointFit without = fit_without(t, fewer);
  const Eigen::MatrixXd predicted = predict_response(data_.observations(), {}, data_.rows());
  const CrossValidation own = unseen(found_.fit, found_.fit.variances);
  for (const Term& way : data_.ways()) {
    const std::string cause = way.effect->cause();
    const bool taken = already_in(way, found_.fit.model) || cause == accepted.term.effect->cause() ||
                       std::any_of(result.begin(), result.end(),
                                   [&](const Ranked& r) { return r.term.effect->cause() == cause; });
    if (taken) continue;
    Observations other = data_.observations();
    other.slopes.col(place) = respond(way, data_.observations(), predicted).derivative[0][0];
    other.beyond.col(own_place).setZero();
    MeanModel instead = found_.fit.model;
    instead.terms[t] = way;
    instead.terms[t].per_group = true;
    const JointFit fit = fit_in_turns(other, instead, data_.rows());
    const CrossValidation with_other = unseen(other, fit, found_.fit.variances);
    if (compare(with_other, own).told_apart()) continue;
    const double evidence =
        -std::log10(std::max(p_of_groups(fewer, without, other, fit), 1e-300)) + std::log10(kWeightInGroups);
    if (evidence >= found_.critical && fit.at_bound.empty() && groups_within_bounds(other, fit, t))
      result.push_back({.term = way});
  }
  return result;
}

void Search::name_newest_curve(const JointFit& without) {
  const Found with_it = found_;
  FoundCurve newest = with_it.curves.back();
  const JointFit& with_curve = with_it.fit;
  found_.curves.pop_back();
  found_.fit = without;
  const Scan scan = scan_effects(found_.fit);
  const double critical = scan.order.empty() ? 0 : maxima_of(found_.fit, scan, Draws::kRivals).critical();
  const CrossValidation of_curve = unseen(with_curve, with_curve.variances);
  const auto left_of_curve = [&](const JointFit& beside) {
    const CandidateScan alone(data_.mixed(), beside.linear.columns, {as_candidate(newest.curve)});
    return alone.fit(difference(data_.y(), beside.linear.offset))[0].likelihood_ratio;
  };
  std::set<std::string> tried;
  for (const std::size_t i : scan.order) {
    if (scan.fits[i].evidence < critical) break;
    if (!tried.insert(scan.ways[i].effect->cause()).second) continue;
    const JointFit fit = fit_with(scan.ways[i], scan.fits[i].amplitude(0));
    const CrossValidation after = unseen(fit, fit.variances);
    if (why_not(fit, after, compare(unseen(found_.fit, fit.variances), after)) ||
        compare(unseen(fit, with_curve.variances), of_curve).told_apart())
      continue;
    if (2 * left_of_curve(fit) > left_of_curve(without))
      continue;  // a small one of its own, beside the curve
    newest.could_be.push_back(fit.model.terms.back());
  }
  found_ = with_it;
  found_.curves.back() = std::move(newest);
}

}  // namespace tunnelrig
