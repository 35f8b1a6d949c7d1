#include "analysis/residual/search/curve_steps.h"

#include "analysis/residual/observations/condition_values.h"
#include "analysis/residual/search/curve_scan.h"
#include "analysis/residual/search/curve_work.h"
#include "analysis/residual/search/effect_steps.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/older_effects.h"
#include "analysis/residual/search/one_block.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

void add_curve(const SearchData& data, Found& found, const Curve& curve, double p) {
  found.add_curve({.curve = curve, .p = p, .instead_of = {}}, fit_with_curve(data, found.fit, curve));
}

void set_curve(const SearchData& data, Found& found, std::size_t c, const Curve& form) {
  MeanModel model = found.fit.model;
  model.curves[c] = form;
  found.set_curve(c, form, fit_jointly(data.observations(), model, data.rows()));
}

/// Takes accepted effect t out, and gives the newest curve the straight part that no name takes any more.
/// `without`: the fit without the effect.
void give_way_to_curve(const SearchData& data, Found& found, std::size_t t, const JointFit& without) {
  found.curves.back().instead_of.push_back(found.accepted[t].term.effect->name);
  found.drop(t, without);
  const std::size_t newest = found.curves.size() - 1;
  set_curve(data, found, newest, with_trend(found.curves[newest].curve));
}

/// A name whose work a curve does as well was the wrong name for that curve.
void drop_what_a_curve_replaces(const SearchData& data, Found& found, Questions& questions) {
  for (std::size_t t = found.accepted.size(); t-- > 0;) {
    const Term term = found.accepted[t].term;
    // Those of groups stand in the baseline; that forces go with the square of the speed is not in doubt.
    if (term.per_group || term.effect->theory_only) continue;
    // What two conditions do together is not what one of them does.
    const bool product = found.curves.back().curve.strength.has_value();
    const JointFit without = fit_without(data, found.fit, t);
    if (outshone_by_curve(data, found, term)) {
      give_way_to_curve(data, found, t, without);
    } else if (!product && !is_still_found(data, found, term, without, questions)) {
      found.curves.back().could_be.push_back({.term = term});
      found.drop(t, without);
    }
  }
}

/// Of the smooth forms of what a curve over the runs has found: as many columns as they ask for.
Curve best_of(const std::vector<Curve>& forms, const SearchData& data, const JointFit& without) {
  std::vector<Candidate> candidates;
  for (const Curve& form : forms) candidates.push_back(as_candidate(form));
  const auto fits = CandidateScan(data.mixed(), without.linear.columns, candidates)
                        .fit(difference(data.y(), without.linear.offset));
  const Covariate measured =
      as_measured_along(*data.observations().find(forms[0].covariate), forms.back().shape);
  const double n = places_on_range(measured, data.rows(), forms[0].rotor);
  const auto criterion = [&](std::size_t i) {   // Hurvich & Tsai 1989
    const auto k = static_cast<double>(i + 2);  // columns and a constant
    return 2 * (k + 1) * n / std::max(n - k - 2, 1.0) - 2 * fits[i].likelihood_ratio;
  };
  std::size_t best = 0;
  for (std::size_t i = 1; i < forms.size(); ++i)
    if (criterion(i) < criterion(best)) best = i;
  return forms[best];
}

struct Chosen {
  std::size_t curve;  // of those that were tried
  double p;
};

/// Of the curves that all runs show, the best that those without the block show too; what they do not show is
/// recorded.
std::optional<Chosen> best_without(SearchState& state, const CurveScan& curves, NullMaxima& maxima,
                                   int block) {
  const double alpha = state.data.settings().alpha;
  std::vector<std::size_t> beyond_chance;
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < curves.tried.size(); ++i)
    if (maxima.p(curves.scan.fits[i].evidence) <= alpha) {
      beyond_chance.push_back(i);
      candidates.push_back(curves.scan.candidates[i]);
    }
  const auto without = fits_without(state.data, state.found.fit, block, candidates);
  std::optional<Chosen> best;
  double most = 0;
  for (std::size_t k = 0; k < beyond_chance.size(); ++k) {
    const Curve& curve = curves.tried[beyond_chance[k]];
    const double p = maxima.p(without[k].evidence);
    if (p > alpha) {
      state.record.of_one_block.push_back({curve.covariate, curve.rotor, curve.label(), block});
    } else if (!best || without[k].evidence > most) {
      best = Chosen{beyond_chance[k], p};
      most = without[k].evidence;
    }
  }
  return best;
}

/// The curve to add: the best of a scan; where the runs without one block say little of that, the best of
/// these, if it is beyond chance there as well.
std::optional<Chosen> choose(SearchState& state, const CurveScan& curves, NullMaxima& maxima) {
  constexpr double kLittle = 0.2;  // of data sets without effect so many have as much
  const SearchData& data = state.data;
  const std::size_t first = curves.scan.order[0];
  const Chosen best{first, maxima.p(curves.scan.fits[first].evidence)};
  std::string& outcome = state.record.curve_rounds.back().outcome;
  outcome = fmt::format("p = {:.3g} for {}", best.p, curves.tried[first].label());
  if (best.p > data.settings().alpha) return {};
  if (data.observations().blocks_are_rows) return best;  // of which a wild one is told by itself
  const int block = block_missed_most(data, state.found.fit, curves.tried[first].columns);
  const auto rest = fits_without(data, state.found.fit, block, {curves.scan.candidates[first]});
  if (maxima.p(rest[0].evidence) <= kLittle) return best;
  const std::optional<Chosen> other = best_without(state, curves, maxima, block);
  outcome +=
      fmt::format(", by block {} alone", data.observations().block_name[static_cast<std::size_t>(block)]);
  if (other)
    outcome += fmt::format("; without it p = {:.3g} for {}", other->p, curves.tried[other->curve].label());
  return other;
}

}  // namespace

void add_curves(SearchState& state, const CurveScan& first) {
  const int most = state.data.settings().most_curves;
  bool added = most > 0 && add_best_curve(state, first);
  while (added) {
    place_steps(state.data, state.found);
    drop_what_a_curve_replaces(state.data, state.found, state.questions);
    add_effects(state);
    added = static_cast<int>(state.found.curves.size()) < most &&
            add_best_curve(state, scan_curves(state.data, state.found));
  }
}

bool add_best_curve(SearchState& state, const CurveScan& curves) {
  state.data.settings().progress("looking for structure without a name");
  const auto& [scan, tried] = curves;
  if (tried.empty()) return false;
  NullMaxima maxima = state.questions.maxima_of(state.data, state.found.fit, scan, Draws::kCurves);
  state.record.curve_rounds.emplace_back().observed = scan.fits[scan.order[0]].evidence;
  const std::optional<Chosen> chosen = choose(state, curves, maxima);
  state.record.curve_rounds.back().null_maxima = maxima.values();
  if (!chosen) return false;
  const std::size_t curve = everywhere_instead(state.data, state.found.fit, curves, chosen->curve);
  add_curve(state.data, state.found, tried[curve], chosen->p);
  return true;
}

void smooth_curves(const SearchData& data, Found& found, std::size_t first) {
  for (std::size_t c = first; c < found.curves.size(); ++c) {
    const std::vector<Curve> forms = smooth_forms(data.observations(), found.curves[c].curve, data.rows());
    if (forms.empty()) continue;
    set_curve(data, found, c, best_of(forms, data, fit_without_curve(data, found.fit, c)));
  }
}

bool bends_away(const SearchData& data, const Found& found, std::size_t t, Questions& questions) {
  const Term& term = found.accepted[t].term;
  if (term.per_group || term.effect->theory_only) return false;
  const CurveScan bends = scan_bends(data, found, term);
  if (bends.tried.empty()) return false;
  const std::size_t best = bends.scan.order[0];
  const double p_allowed = data.settings().alpha / 2;  // one question of each name, not the largest of many
  SearchSettings enough = data.settings();             // data sets for such a p
  enough.simulations = std::max(enough.simulations, static_cast<std::size_t>(std::ceil(1 / p_allowed)));
  const double p = questions.maxima_of(data, found.fit, bends.scan, Draws::kBends, enough)
                       .p(bends.scan.fits[best].evidence);
  if (p > p_allowed) return false;
  Found bent = found;
  add_curve(data, bent, bends.tried[best], p);
  return outshone_by_curve(data, bent, bent.accepted[t].term);
}

}  // namespace tunnelrig
