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
  for (std::size_t t = 0; t < result_.accepted.size(); ++t) {
    Accepted& accepted = result_.accepted[t];
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
  const Components y = difference(y_, without.linear.offset);
  const Eigen::MatrixXd predicted = predict_response(observations_, without.model, rows_);
  const auto validate = [&](const Term& way, const Candidate& candidate) {
    std::vector<Components> columns = without.linear.columns;
    if (way.effect->theory_only) {  // with another amplitude it would be another effect
      Term at_theory = way;
      at_theory.parameters[0] = *way.effect->theory();
      return cross_validate(observations_, difference(y, respond(at_theory, observations_, predicted).value),
                            columns, fit_.variances, rows_);
    }
    columns.push_back(candidate.columns[0]);
    return cross_validate(observations_, y, columns, fit_.variances, rows_);
  };
  std::optional<CrossValidation> own;
  for (const std::size_t i : scan.order)
    if (!own && scan.ways[i].effect->cause() == accepted.term.effect->cause() &&
        scan.ways[i].rotor == accepted.term.rotor)
      own = validate(scan.ways[i], scan.candidates[i]);
  if (!own) return result;
  std::vector<std::string> done = {accepted.term.effect->cause()};
  for (const std::size_t i : scan.order) {
    if (scan.fits[i].evidence < critical_) break;
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
    const JointFit fit = fit_jointly(observations_, instead, rows_);
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
  while (!fit_.model.terms[t].same_way(accepted.term)) ++t;
  const Index own_place = place_among_own(fit_.model, t);
  const Index place = observations_.first_own_slope() + own_place;
  const Observations fewer = without_own(observations_, fit_.model, t);
  const JointFit without = fit_without(t, fewer);
  const Eigen::MatrixXd predicted = predict_response(observations_, {}, rows_);
  const CrossValidation own = unseen(fit_, fit_.variances);
  for (const Term& way : ways_) {
    const std::string cause = way.effect->cause();
    const bool taken = already_in(way, fit_.model) || cause == accepted.term.effect->cause() ||
                       std::any_of(result.begin(), result.end(),
                                   [&](const Ranked& r) { return r.term.effect->cause() == cause; });
    if (taken) continue;
    Observations other = observations_;
    other.slopes.col(place) = respond(way, observations_, predicted).derivative[0][0];
    other.beyond.col(own_place).setZero();
    MeanModel instead = fit_.model;
    instead.terms[t] = way;
    instead.terms[t].per_group = true;
    const JointFit fit = fit_in_turns(other, instead, rows_);
    const CrossValidation with_other = unseen(other, fit, fit_.variances);
    if (compare(with_other, own).told_apart()) continue;
    const double evidence =
        -std::log10(std::max(p_of_groups(fewer, without, other, fit), 1e-300)) + std::log10(kWeightInGroups);
    if (evidence >= critical_ && fit.at_bound.empty() && groups_within_bounds(other, fit, t))
      result.push_back({.term = way});
  }
  return result;
}

void Search::name_newest_curve(const JointFit& without) {
  FoundCurve newest = std::move(result_.curves.back());
  result_.curves.pop_back();
  const JointFit with_curve = std::exchange(fit_, without);
  const Scan scan = scan_effects(fit_);
  const double critical = scan.order.empty() ? 0 : maxima_of(fit_, scan, Draws::kRivals).critical();
  const CrossValidation of_curve = unseen(with_curve, with_curve.variances);
  const auto left_of_curve = [&](const JointFit& beside) {
    const CandidateScan alone(*mixed_, beside.linear.columns, {as_candidate(newest.curve)});
    return alone.fit(difference(y_, beside.linear.offset))[0].likelihood_ratio;
  };
  std::set<std::string> tried;
  for (const std::size_t i : scan.order) {
    if (scan.fits[i].evidence < critical) break;
    if (!tried.insert(scan.ways[i].effect->cause()).second) continue;
    const JointFit fit = fit_with(scan.ways[i], scan.fits[i].amplitude(0));
    const CrossValidation after = unseen(fit, fit.variances);
    if (why_not(fit, after, compare(unseen(fit_, fit.variances), after)) ||
        compare(unseen(fit, with_curve.variances), of_curve).told_apart())
      continue;
    if (2 * left_of_curve(fit) > left_of_curve(without))
      continue;  // a small one of its own, beside the curve
    newest.could_be.push_back(fit.model.terms.back());
  }
  fit_ = with_curve;
  result_.curves.push_back(std::move(newest));
}

}  // namespace tunnelrig
