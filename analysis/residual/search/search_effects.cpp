// Named effects: ranked, tried, accepted one by one.
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/best_run.h"
#include "analysis/residual/search/detectable.h"
#include "analysis/residual/search/effect_scan.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/rivals.h"
#include "analysis/residual/search/rules.h"
#include "analysis/residual/search/search.h"
#include "analysis/residual/search/together.h"
#include "analysis/residual/search/unseen.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

constexpr double kClearDecades = 2;  // beyond the one that is accepted: worth a word

}  // namespace

void Search::add_effects() {
  bool wider = true;
  while (wider) {
    while (static_cast<int>(found_.accepted.size()) < data_.settings().most_effects && add_best_effect()) {
      ask_older_again();
      while (change_a_form()) {
      }
    }
    wider = let_any_differ();
  }
}

bool Search::add_best_effect() {
  data_.settings().progress(fmt::format("looking for effect {}", found_.accepted.size() + 1));
  const Scan scan = scan_effects_and_groups(data_, found_);
  Round round;
  if (scan.order.empty()) return false;
  NullMaxima maxima = questions_.maxima_of(data_, found_.fit, scan, Draws::kEffects);
  const double p = maxima.p(scan.fits[scan.order[0]].evidence);
  if (p <= data_.settings().alpha || found_.critical == 0) found_.critical = maxima.critical();
  round.observed = scan.fits[scan.order[0]].evidence;
  round.critical =
      p <= data_.settings().alpha ? found_.critical : critical_of(maxima.values(), data_.settings().alpha);
  round.ranking = ranking(scan, maxima);
  round.null_maxima = maxima.values();
  if (result_.rounds.empty()) {
    const Detectable detectable = detectable_by(data_, found_, scan, result_.detectable_sigma);
    result_.detectable_sigma = detectable.largest;
    result_.detectable_by_effect = detectable.by_effect;
  }
  const bool added = p <= data_.settings().alpha && accept_first_sound(scan, maxima, round);
  if (!added && round.outcome.empty())
    round.outcome = fmt::format("nothing: p = {:.3g} for {}", p, scan.ways[scan.order[0]].label());
  result_.rounds.push_back(std::move(round));
  return added;
}

std::vector<Ranked> Search::ranking(const Scan& scan, NullMaxima& maxima) const {
  std::vector<Ranked> result;
  for (const std::size_t i : scan.order) {
    const bool seen = std::any_of(result.begin(), result.end(), [&](const Ranked& r) {
      return r.term.effect->name == scan.ways[i].effect->name;
    });
    if (seen) continue;
    const CandidateFit& fit = scan.fits[i];
    const bool one = fit.amplitude.size() == 1 && fit.likelihood_ratio > 0;
    const double amplitude = fit.amplitude.size() > 0 ? fit.amplitude.mean() : 0;
    result.push_back({scan.ways[i], fit.evidence, maxima.p(fit.evidence), amplitude,
                      one ? std::abs(amplitude) / std::sqrt(2 * fit.likelihood_ratio) : 0});
  }
  return result;
}

bool Search::accept_first_sound(const Scan& scan, NullMaxima& maxima, Round& round) {
  std::vector<const Effect*> tried;
  std::optional<BeyondBounds> beyond;  // of the first, and none about as good is accepted
  const std::size_t had = found_.accepted.size();
  for (const std::size_t best : scan.order) {
    if (scan.fits[best].evidence < found_.critical) break;
    if (beyond && scan.fits[best].evidence < scan.fits[scan.order[0]].evidence - kClearDecades)
      found_.beyond_bounds.push_back(*std::exchange(beyond, std::nullopt));
    const bool together = scan.others.contains(best);
    if (!together) {
      if (std::ranges::find(tried, scan.ways[best].effect) != tried.end()) continue;
      tried.push_back(scan.ways[best].effect);
    }
    if (!(together ? accept_together(scan, best, maxima.p(scan.fits[best].evidence))
                   : accept(scan, best, maxima, round, beyond)))
      continue;
    std::vector<std::string> labels;
    for (std::size_t k = had; k < found_.accepted.size(); ++k)
      labels.push_back(found_.accepted[k].term.label());
    round.outcome += fmt::format("accepted {}", fmt::join(labels, " and "));
    return true;
  }
  if (beyond) found_.beyond_bounds.push_back(*beyond);
  return false;
}

std::size_t Search::alike_instead(const Scan& scan, std::size_t i) const {
  if (!scan.ways[i].per_group) return i;
  for (const std::size_t other : scan.order)
    if (scan.ways[other].effect == scan.ways[i].effect && !scan.ways[other].per_group &&
        scan.fits[other].evidence >= found_.critical)
      return other;
  return i;
}

bool Search::accept(const Scan& scan, std::size_t best, NullMaxima& maxima, Round& round,
                    std::optional<BeyondBounds>& beyond) {
  const std::size_t i = alike_instead(scan, best);
  if (scan.ways[i].per_group) {
    if (accept_in_groups(scan.ways[i], maxima.p(scan.fits[i].evidence))) return true;
    round.outcome +=
        fmt::format("{} predicts unseen blocks no better, or not better than what is alike in all; ",
                    scan.ways[i].label());
    return false;
  }
  JointFit fit = fit_with(data_, found_.fit, scan.ways[i], scan.fits[i].amplitude(0));
  const CrossValidation after = unseen(data_, fit, fit.variances);
  // Both are scored by the variances of the larger model, so that the difference is the mean's.
  if (const auto reason =
          why_not(data_, found_, fit, after, compare(unseen(data_, found_.fit, fit.variances), after))) {
    round.outcome += *reason + "; ";
    if (scan.ways[best].per_group && accept_in_groups(scan.ways[best], maxima.p(scan.fits[best].evidence)))
      return true;
    const Term& bounded = fit.model.terms.back();
    if (best == scan.order[0] && at_bound(fit, bounded) && !lacks_speed_squared(data_, found_, bounded))
      beyond = beyond_bounds(data_, found_.fit, scan.ways[i], scan.fits[i].amplitude(0));
    return false;
  }
  const double p = maxima.p(scan.fits[i].evidence);
  found_.accept(at_best_run(data_.observations(), std::move(fit), 1, data_.rows()).fit, p);
  let_groups_differ(found_.accepted.size() - 1, true);
  return true;
}

bool Search::accept_together(const Scan& scan, std::size_t i, double p) {
  std::optional<JointFit> fit = fit_together(data_, found_, scan, i);
  if (fit) found_.accept(std::move(*fit), p);
  return fit.has_value();
}

bool Search::let_groups_differ(std::size_t t, bool before_others) {
  std::optional<InGroups> own = let_differ(data_, found_, t, before_others);
  if (!own) return false;
  data_.set_observations(std::move(own->observations));
  found_.make_newest(t, std::move(own->fit));
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
    if (const JointFit without = fit_without(data_, found_.fit, k); !is_still_found(term, without))
      found_.drop(k, without);
  }
  return true;
}

bool Search::accept_in_groups(const Term& way, double p) {
  std::optional<InGroups> own = new_in_groups(data_, found_, way);
  if (!own) return false;
  data_.set_observations(std::move(own->observations));
  found_.accept(std::move(own->fit), p);
  return true;
}

void Search::place_steps() {
  for (std::size_t k = 1; k <= found_.fit.model.terms.size(); ++k) {
    Placed placed = at_best_run(data_.observations(), found_.fit, k, data_.rows());
    if (placed.observations) data_.set_observations(std::move(*placed.observations));
    found_.set_fit(std::move(placed.fit));
  }
}

void Search::measure_gains() {
  const double with = unseen(data_, found_.fit, found_.fit.variances).rmse();
  for (std::size_t t = 0; t < found_.accepted.size(); ++t) {
    Observations others = found_.accepted[t].term.per_group
                              ? without_own(data_.observations(), found_.fit.model, t)
                              : data_.observations();
    const JointFit without = fit_in_turns(others, found_.fit.model.without_term(t), data_.rows());
    found_.accepted[t].gain = unseen(data_, others, without, without.variances).rmse() - with;
  }
}

void Search::find_confounded() {
  for (std::size_t t = 0; t < found_.accepted.size(); ++t)
    found_.accepted[t].confounded = rivals_of(data_, found_, t);
}

}  // namespace tunnelrig
