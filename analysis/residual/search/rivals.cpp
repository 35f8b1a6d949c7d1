#include "analysis/residual/search/rivals.h"

#include "analysis/residual/search/effect_scan.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/in_groups.h"
#include "analysis/residual/search/rules.h"
#include "analysis/residual/search/unseen.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <string>

namespace tunnelrig {
namespace {

using Eigen::Index;

constexpr int kMostWays = 3;  // of each cause are tried

bool within_bounds(const Term& way, const CandidateFit& fit) {
  const EffectParameter& amplitude = way.effect->parameters[0];
  return fit.amplitude(0) >= amplitude.lower && fit.amplitude(0) <= amplitude.upper;
}

/// Leave-one-block-out on top of a fit, with the variances of what was found.
class Validation {
 public:
  Validation(const SearchData& data, const NullFit& variances, const JointFit& without)
      : data_(data),
        variances_(variances),
        columns_(without.linear.columns),
        y_(difference(data.y(), without.linear.offset)),
        predicted_(predict_response(data.observations(), without.model, data.rows())) {}

  CrossValidation operator()(const Term& way, const Candidate& candidate) const {
    std::vector<Components> columns = columns_;
    if (way.effect->theory_only) {  // with another amplitude it would be another effect
      Term at_theory = way;
      at_theory.parameters[0] = *way.effect->theory();
      return cross_validate(data_.observations(),
                            difference(y_, respond(at_theory, data_.observations(), predicted_).value),
                            columns, variances_, data_.rows());
    }
    columns.push_back(candidate.columns[0]);
    return cross_validate(data_.observations(), y_, columns, variances_, data_.rows());
  }

  /// Of the best way of an effect's cause on its rotor; none where it is not in the scan.
  std::optional<CrossValidation> of_same(const Term& term, const Scan& scan) const {
    for (const std::size_t i : scan.order)
      if (scan.ways[i].effect->cause() == term.effect->cause() && scan.ways[i].rotor == term.rotor)
        return (*this)(scan.ways[i], scan.candidates[i]);
    return std::nullopt;
  }

 private:
  const SearchData& data_;
  const NullFit& variances_;
  const std::vector<Components>& columns_;
  Components y_;
  Eigen::MatrixXd predicted_;
};

/// With a way of the scan in the place of an effect; nothing where that, or what the others must be beside
/// it, is not physical.
std::optional<Term> instead(const SearchData& data, const JointFit& without, const Scan& scan,
                            std::size_t i) {
  Term term = scan.ways[i];
  if (!term.effect->theory_only && !within_bounds(term, scan.fits[i])) return std::nullopt;
  term.parameters[0] = term.effect->theory_only ? *term.effect->theory() : scan.fits[i].amplitude(0);
  MeanModel model = without.model;
  model.terms.push_back(term);
  model.terms.back().at_theory = term.effect->theory_only;
  const JointFit fit = fit_jointly(data.observations(), model, data.rows());
  const auto& terms = fit.model.terms;
  if (std::any_of(terms.begin(), std::prev(terms.end()),
                  [&](const Term& each) { return at_bound(fit, each); }))
    return std::nullopt;
  return terms.back();
}

std::vector<Ranked> rivals(const SearchData& data, const Found& found, const Accepted& accepted,
                           const JointFit& without, const Scan& scan) {
  std::vector<Ranked> result;
  const Validation validate(data, found.fit.variances, without);
  const std::optional<CrossValidation> own = validate.of_same(accepted.term, scan);
  if (!own) return result;
  std::vector<std::string> done = {accepted.term.effect->cause()};
  for (const std::size_t i : scan.order) {
    if (scan.fits[i].evidence < found.critical) break;
    const std::string cause = scan.ways[i].effect->cause();
    if (std::count(done.begin(), done.end(), cause) >= kMostWays) continue;
    done.push_back(cause);
    if (cause == accepted.term.effect->cause() ||
        std::ranges::any_of(result, [&](const Ranked& r) { return r.term.effect->cause() == cause; }))
      continue;
    if (compare(validate(scan.ways[i], scan.candidates[i]), *own).told_apart()) continue;
    if (const auto term = instead(data, without, scan, i))
      result.push_back({*term, scan.fits[i].evidence, 0, term->parameters[0], 0});
  }
  return result;
}

/// The same for an effect with an amplitude of each group's own: each rival takes its place in the baseline.
std::vector<Ranked> rivals_in_groups(const SearchData& data, const Found& found, const Accepted& accepted) {
  std::size_t t = 0;
  while (!found.fit.model.terms[t].same_way(accepted.term)) ++t;
  std::vector<Ranked> result;
  const Index own_place = place_among_own(found.fit.model, t);
  const Index place = data.observations().first_own_slope() + own_place;
  const Observations fewer = without_own(data.observations(), found.fit.model, t);
  const JointFit without = fit_jointly(fewer, found.fit.model.without_term(t), data.rows());
  const Eigen::MatrixXd predicted = predict_response(data.observations(), {}, data.rows());
  const CrossValidation own = unseen(data, found.fit, found.fit.variances);
  for (const Term& way : data.ways()) {
    const std::string cause = way.effect->cause();
    const bool taken = already_in(way, found.fit.model, data.observations().channels()) ||
                       cause == accepted.term.effect->cause() ||
                       std::any_of(result.begin(), result.end(),
                                   [&](const Ranked& r) { return r.term.effect->cause() == cause; });
    if (taken) continue;
    Observations other = data.observations();
    other.slopes.col(place) = respond(way, data.observations(), predicted).derivative[0][0];
    other.beyond.col(own_place).setZero();
    MeanModel instead = found.fit.model;
    instead.terms[t] = way;
    instead.terms[t].per_group = true;
    const JointFit fit = fit_in_turns(other, instead, data.rows());
    const CrossValidation with_other = unseen(data, other, fit, found.fit.variances);
    if (compare(with_other, own).told_apart()) continue;
    const double evidence = -std::log10(std::max(p_of_groups(data, fewer, without, other, fit), 1e-300)) +
                            std::log10(kWeightInGroups);
    if (evidence >= found.critical && fit.at_bound.empty() && groups_within_bounds(data, other, fit, t))
      result.push_back({.term = way});
  }
  return result;
}

}  // namespace

std::vector<Ranked> rivals_of(const SearchData& data, const Found& found, std::size_t t) {
  if (found.accepted[t].term.per_group) return rivals_in_groups(data, found, found.accepted[t]);
  const JointFit without = fit_without(data, found.fit, t);
  return rivals(data, found, found.accepted[t], without, scan_effects(data, found, without));
}

std::vector<Ranked> still_rivals_of(const SearchData& data, const Found& found, std::size_t t) {
  const Accepted& accepted = found.accepted[t];
  if (accepted.confounded.empty() || accepted.term.per_group) return accepted.confounded;
  const JointFit without = fit_without(data, found.fit, t);
  const Scan scan = scan_effects(data, found, without);
  const Validation validate(data, found.fit.variances, without);
  const std::optional<CrossValidation> own = validate.of_same(accepted.term, scan);
  if (!own) return accepted.confounded;
  const auto is_told_apart = [&](const Ranked& rival) {
    int tried = 0;
    for (const std::size_t i : scan.order) {
      if (scan.ways[i].effect->cause() != rival.term.effect->cause()) continue;
      if (!compare(validate(scan.ways[i], scan.candidates[i]), *own).told_apart()) return false;
      if (++tried == kMostWays) break;
    }
    return tried > 0;
  };
  std::vector<Ranked> left = accepted.confounded;
  std::erase_if(left, is_told_apart);
  return left;
}

std::vector<Term> names_of_curve(const SearchData& data, const Found& found, std::size_t c,
                                 const JointFit& without, Questions& questions) {
  Found before = found;
  before.curves.erase(before.curves.begin() + static_cast<std::ptrdiff_t>(c));
  before.set_fit(without);
  const Scan scan = scan_effects(data, before, without);
  const double critical =
      scan.order.empty() ? 0 : questions.maxima_of(data, without, scan, Draws::kRivals).critical();
  const NullFit& variances = found.fit.variances;
  const CrossValidation of_curve = unseen(data, found.fit, variances);
  const auto left_of_curve = [&](const JointFit& beside) {
    const CandidateScan alone(data.mixed(), beside.linear.columns, {as_candidate(found.curves[c].curve)});
    return alone.fit(difference(data.y(), beside.linear.offset))[0].likelihood_ratio;
  };
  std::vector<Term> names;
  std::set<std::string> tried;
  for (const std::size_t i : scan.order) {
    if (scan.fits[i].evidence < critical) break;
    if (!tried.insert(scan.ways[i].effect->cause()).second) continue;
    const JointFit fit = fit_with(data, without, scan.ways[i], scan.fits[i].amplitude(0));
    const CrossValidation after = unseen(data, fit, fit.variances);
    if (why_not(data, before, fit, unseen(data, without, fit.variances), after) ||
        compare(unseen(data, fit, variances), of_curve).told_apart())
      continue;
    // Less: a small one of its own, beside the curve.
    if (!(2 * left_of_curve(fit) > left_of_curve(without))) names.push_back(fit.model.terms.back());
  }
  return names;
}

}  // namespace tunnelrig
