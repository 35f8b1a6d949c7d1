#include "analysis/residual/search/effect_steps.h"

#include "analysis/residual/search/best_run.h"
#include "analysis/residual/search/detectable.h"
#include "analysis/residual/search/effect_scan.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/group_steps.h"
#include "analysis/residual/search/older_effects.h"
#include "analysis/residual/search/rules.h"
#include "analysis/residual/search/together.h"
#include "analysis/residual/search/unseen.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

constexpr double kClearDecades = 2;  // beyond the one that is accepted: worth a word

/// Candidates of one scan, tried one after the other.
struct Trial {
  const Scan& scan;
  NullMaxima& maxima;
  std::string refused = {};                 // which of them, and why, in words
  std::optional<BeyondBounds> beyond = {};  // the first, as long as none about as good is accepted

  double evidence(std::size_t i) const { return scan.fits[i].evidence; }
  double p(std::size_t i) const { return maxima.p(evidence(i)); }
};

/// The best way of each effect.
std::vector<Ranked> ranking(const Scan& scan, NullMaxima& maxima) {
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

/// In place of a candidate with amplitudes of the groups' own: the same effect alike in all, if α lets it in.
std::size_t alike_instead(const Scan& scan, double critical, std::size_t i) {
  if (!scan.ways[i].per_group) return i;
  for (const std::size_t other : scan.order)
    if (scan.ways[other].effect == scan.ways[i].effect && !scan.ways[other].per_group &&
        scan.fits[other].evidence >= critical)
      return other;
  return i;
}

bool accept_together(SearchState& state, const Trial& trial, std::size_t i) {
  const double p = trial.p(i);
  std::optional<JointFit> fit = fit_together(state.data, state.found, trial.scan, i);
  if (fit) state.found.accept(std::move(*fit), p);
  return fit.has_value();
}

/// A candidate that is one effect, alike in all groups or with their own amplitudes.
bool accept(SearchState& state, Trial& trial, std::size_t best) {
  const SearchData& data = state.data;
  const Scan& scan = trial.scan;
  const std::size_t i = alike_instead(scan, state.found.critical, best);
  const Term& way = scan.ways[i];
  if (way.per_group) {
    if (accept_in_groups(state, way, trial.p(i))) return true;
    trial.refused += fmt::format(
        "{} predicts unseen blocks no better, or not better than what is alike in all; ", way.label());
    return false;
  }
  JointFit fit = fit_with(data, state.found.fit, way, scan.fits[i].amplitude(0));
  const CrossValidation after = unseen(data, fit, fit.variances);
  // Both are scored by the variances of the larger model, so that the difference is the mean's.
  const CrossValidation before = unseen(data, state.found.fit, fit.variances);
  if (const auto reason = why_not(data, state.found, fit, before, after)) {
    trial.refused += *reason + "; ";
    if (scan.ways[best].per_group && accept_in_groups(state, scan.ways[best], trial.p(best))) return true;
    const Term& bounded = fit.model.terms.back();
    if (best == scan.order[0] && at_bound(fit, bounded) && !lacks_speed_squared(data, state.found, bounded))
      trial.beyond = beyond_bounds(data, state.found.fit, way, scan.fits[i].amplitude(0));
    return false;
  }
  const double p = trial.p(i);
  state.found.accept(at_best_run(data.observations(), std::move(fit), 1, data.rows()).fit, p);
  let_groups_differ(state, state.found.accepted.size() - 1, true);
  return true;
}

/// The best candidate whose parameters stay within physics and which predicts blocks that it has not seen.
bool accept_first_sound(SearchState& state, Trial& trial) {
  const Scan& scan = trial.scan;
  std::vector<const Effect*> tried;
  for (const std::size_t best : scan.order) {
    if (trial.evidence(best) < state.found.critical) break;
    if (trial.beyond && trial.evidence(best) < trial.evidence(scan.order[0]) - kClearDecades)
      state.found.beyond_bounds.push_back(*std::exchange(trial.beyond, std::nullopt));
    const bool together = scan.others.contains(best);
    if (!together) {
      if (std::ranges::find(tried, scan.ways[best].effect) != tried.end()) continue;
      tried.push_back(scan.ways[best].effect);
    }
    if (together ? accept_together(state, trial, best) : accept(state, trial, best)) return true;
  }
  if (trial.beyond) state.found.beyond_bounds.push_back(*trial.beyond);
  return false;
}

std::string labels_from(const std::vector<Accepted>& accepted, std::size_t first) {
  std::vector<std::string> labels;
  for (std::size_t k = first; k < accepted.size(); ++k) labels.push_back(accepted[k].term.label());
  return fmt::format("{}", fmt::join(labels, " and "));
}

bool add_best_effect(SearchState& state) {
  Found& found = state.found;
  const double alpha = state.data.settings().alpha;
  const std::size_t had = found.accepted.size();
  state.data.settings().progress(fmt::format("looking for effect {}", had + 1));
  const Scan scan = scan_effects_and_groups(state.data, found);
  if (scan.order.empty()) return false;
  NullMaxima maxima = state.questions.maxima_of(state.data, found.fit, scan, Draws::kEffects);
  Trial trial{scan, maxima};
  const double p = trial.p(scan.order[0]);
  if (p <= alpha || found.critical == 0) found.critical = maxima.critical();
  Round round;
  round.observed = trial.evidence(scan.order[0]);
  round.critical = p <= alpha ? found.critical : critical_of(maxima.values(), alpha);
  round.ranking = ranking(scan, maxima);
  round.null_maxima = maxima.values();
  if (state.record.rounds.empty())
    state.record.detectable = detectable_by(state.data, found, scan, state.record.detectable.largest);
  const bool added = p <= alpha && accept_first_sound(state, trial);
  round.outcome = trial.refused;
  if (added) round.outcome += "accepted " + labels_from(found.accepted, had);
  if (round.outcome.empty())
    round.outcome = fmt::format("nothing: p = {:.3g} for {}", p, scan.ways[scan.order[0]].label());
  state.record.rounds.push_back(std::move(round));
  return added;
}

}  // namespace

void add_effects(SearchState& state) {
  const int most = state.data.settings().most_effects;
  bool wider = true;
  while (wider) {
    while (static_cast<int>(state.found.accepted.size()) < most && add_best_effect(state)) {
      ask_older_again(state.data, state.found, state.questions);
      while (change_a_form(state.data, state.found, state.questions)) {
      }
    }
    wider = let_any_differ(state);
  }
}

void place_steps(SearchData& data, Found& found) {
  for (std::size_t k = 1; k <= found.fit.model.terms.size(); ++k) {
    Placed placed = at_best_run(data.observations(), found.fit, k, data.rows());
    if (placed.observations) data.set_observations(std::move(*placed.observations));
    found.set_fit(std::move(placed.fit));
  }
}

}  // namespace tunnelrig
