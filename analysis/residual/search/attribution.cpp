// The search as a whole: effects, what the runs scatter like beside them, curves, and then what else could be
// said of what was found.
#include "analysis/residual/search/attribution.h"

#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/curve_scan.h"
#include "analysis/residual/search/curve_steps.h"
#include "analysis/residual/search/curve_work.h"
#include "analysis/residual/search/effect_steps.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/rivals.h"
#include "analysis/residual/search/scatter_beside.h"
#include "analysis/residual/search/search_state.h"
#include "analysis/residual/search/unseen.h"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace tunnelrig {
namespace {

/// The model without any effect; what was found before is forgotten.
void begin(SearchState& state) {
  const SearchData& data = state.data;
  state.found = {};
  state.found.fit = fit_jointly(data.observations(), {}, data.rows());
  state.record = {.baseline = state.found.fit};
  state.record.detectable.largest =
      detectable_by_one(data.mixed(), state.found.fit.variances, data.settings().alpha);
}

/// The effects, and the curves on top of them. Where the runs scatter otherwise than it was taken for the
/// search has begun again, with such scatter.
CurveScan search_effects(SearchState& state) {
  begin(state);
  add_effects(state);
  CurveScan curves = scan_curves(state.data, state.found);
  const auto begin_again = [&] {
    std::optional<RunScatter> scatter = other_scatter_beside(state.data, state.found, curves);
    if (!scatter) return false;
    state.data.begin_with(std::move(*scatter));
    begin(state);
    add_effects(state);
    curves = scan_curves(state.data, state.found);
    return true;
  };
  // Once more where rotors differ: what was found while they were taken to be alike may have been scatter.
  if (begin_again() && state.data.observations().scatter.rotors_differ()) begin_again();
  return curves;
}

/// What each accepted effect does for blocks that were not seen, beside all that was found.
void measure_gains(const SearchData& data, Found& found) {
  const JointFit& fit = found.fit;
  const CrossValidation with = unseen(data, fit, fit.variances);
  for (std::size_t t = 0; t < found.accepted.size(); ++t) {
    Observations others = found.accepted[t].term.per_group ? without_own(data.observations(), fit.model, t)
                                                           : data.observations();
    const JointFit without = fit_in_turns(others, fit.model.without_term(t), data.rows());
    found.accepted[t].gain = rmse_gain(unseen(data, others, without, without.variances), with);
  }
}

/// What gave way to a curve, and then to another name over the same condition, may not be it any more.
void forget_what_has_a_name(const Observations& observations, Found& found) {
  const auto has = [&](const CouldBe& name) {
    return std::ranges::any_of(found.accepted, [&](const Accepted& accepted) {
      return share_a_condition(*accepted.term.effect, *name.term.effect, observations);
    });
  };
  const auto is_named = [&](const std::string& name) {
    return std::ranges::any_of(found.accepted,
                               [&](const Accepted& accepted) { return accepted.term.effect->name == name; });
  };
  for (FoundCurve& curve : found.curves) {
    std::erase_if(curve.could_be, has);
    std::erase_if(curve.instead_of, is_named);  // taken again after the curve
  }
}

/// Effects whose curve, the newest, does more beside them than their formulas may leave.
std::set<std::size_t> outshone(const SearchData& data, const Found& found) {
  std::set<std::size_t> result;
  for (std::size_t t = 0; t < found.accepted.size(); ++t)
    if (!found.accepted[t].term.per_group && outshone_by_curve(data, found, found.accepted[t].term))
      result.insert(t);
  return result;
}

/// What all blocks have for curve c, and the open ones have not refused. `without`: the fit without it.
std::vector<CouldBe> names_on_all(SearchState& state, std::size_t c, const JointFit& without,
                                  const Attribution& before) {
  const FoundCurve& curve = state.found.curves[c];
  const auto is_refused = [&](const std::string& name) {
    return std::ranges::count(curve.instead_of, name) > 0 ||
           std::ranges::any_of(curve.could_be,
                               [&](const CouldBe& given) { return given.term.effect->name == name; }) ||
           // With its own size it would be outside of physics here too.
           std::ranges::any_of(before.beyond_bounds,
                               [&](const BeyondBounds& beyond) { return beyond.term.effect->name == name; });
  };
  std::vector<CouldBe> names = curve.could_be;
  for (const Term& term : names_of_curve(state.data, state.found, c, without, state.questions))
    if (!is_refused(term.effect->name)) names.push_back({.term = term, .on_all_blocks = true});
  return names;
}

}  // namespace

Attribution attribute(const Observations& observations, const std::vector<int>& rows,
                      const std::vector<const Effect*>& effects, const SearchSettings& settings) {
  SearchState state{.data = {observations, rows, effects, settings}};
  const SearchData& data = state.data;
  Found& found = state.found;
  add_curves(state, search_effects(state));
  for (std::size_t t = 0; t < found.accepted.size(); ++t)
    found.accepted[t].confounded = rivals_of(data, found, t);
  smooth_curves(data, found);
  measure_gains(data, found);
  forget_what_has_a_name(data.observations(), found);
  Attribution result{.accepted = std::move(found.accepted),
                     .curves = std::move(found.curves),
                     .beyond_bounds = std::move(found.beyond_bounds),
                     .of_one_block = std::move(state.record.of_one_block),
                     .session_unknown = session_scatter_is_large(data, found.fit),
                     .baseline = std::move(state.record.baseline),
                     .final = found.fit,
                     .observations = data.observations(),
                     .rounds = std::move(state.record.rounds),
                     .curve_rounds = std::move(state.record.curve_rounds),
                     .detectable_sigma = state.record.detectable.largest,
                     .detectable_by_effect = std::move(state.record.detectable.by_effect)};
  // The responses of the other rows as well.
  result.observations.value = observations.value;
  result.observations.y = observations.y;
  result.observations.shape = observations.shape;
  return result;
}

StructureLeft structure_left(const Attribution& before, const JointFit& whole, const std::vector<int>& rows,
                             const std::vector<const Effect*>& effects, const SearchSettings& settings) {
  SearchState state{.data = {before.observations, rows, effects, settings},
                    .found = {.fit = {}, .accepted = before.accepted, .curves = before.curves},
                    .questions = Questions(kDrawsOnAllRuns)};
  const SearchData& data = state.data;
  Found& found = state.found;
  found.set_fit(whole);
  StructureLeft left;
  for (std::size_t t = 0; t < found.accepted.size(); ++t)
    if (bends_away(data, found, t, state.questions)) left.bent.insert(t);
  // Of single rows the seal leaves plenty, and what `hold_out` declares is not to be seen by any search.
  const bool few = !data.observations().blocks_are_rows && data.observations().held_out.empty();
  while (few && static_cast<int>(found.curves.size()) < settings.most_curves) {
    const JointFit without = found.fit;
    if (!add_best_curve(state, scan_curves(data, found))) break;
    left.bent.merge(outshone(data, found));
    found.curves.back().could_be = names_on_all(state, found.curves.size() - 1, without, before);
  }
  for (std::size_t t = 0; few && t < found.accepted.size(); ++t)
    left.confounded.push_back(still_rivals_of(data, found, t));
  for (std::size_t c = 0; few && c < before.curves.size(); ++c)
    left.names.push_back(names_on_all(state, c, fit_without_curve(data, found.fit, c), before));
  smooth_curves(data, found, before.curves.size());
  left.curves = {found.curves.begin() + std::ssize(before.curves), found.curves.end()};
  left.fit = std::move(found.fit);
  left.of_one_block = std::move(state.record.of_one_block);
  left.rounds = std::move(state.record.curve_rounds);
  return left;
}

}  // namespace tunnelrig
