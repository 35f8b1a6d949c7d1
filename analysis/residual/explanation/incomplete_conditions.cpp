// Conditions that most runs have, but not all. They are no candidates, and so another may get the name of
// what they do, if it goes with them.
#include "analysis/residual/explanation/explanation_parts.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig {
namespace {

bool has_all(const Observations& observations, int row, const std::vector<std::string>& names) {
  return std::ranges::all_of(
      names, [&](const std::string& name) { return observations.find(name)->value.row(row).allFinite(); });
}

std::ptrdiff_t complete_rows(const Observations& observations, const std::vector<std::string>& names) {
  return std::ranges::count_if(observations.all_rows(),
                               [&](int row) { return has_all(observations, row, names); });
}

/// Those of the conditions with gaps, fewest first, that leave a third of the runs to be looked at alone.
std::vector<std::string> nearly_complete(const Observations& observations) {
  std::vector<std::pair<std::ptrdiff_t, std::string>> missing;
  for (const auto& [name, why] : observations.not_usable) {
    const Covariate* covariate = observations.find(name);
    if (covariate == nullptr || covariate->derived || !why.starts_with("missing")) continue;
    missing.emplace_back(-complete_rows(observations, {name}), name);
  }
  std::ranges::sort(missing);
  std::vector<std::string> names;
  for (const auto& [count, name] : missing) {
    names.push_back(name);
    if (3 * complete_rows(observations, names) < observations.rows()) names.pop_back();
  }
  return names;
}

/// The runs that have all of them, in which they are candidates. Where none that is held out can be scored
/// there, those that are not are sealed by blocks.
Observations with_all(const Observations& observations, const std::vector<std::string>& names) {
  std::vector<int> rows;
  for (const int row : observations.all_rows())
    if (has_all(observations, row, names)) rows.push_back(row);
  Observations complete = observations.subset(rows);
  if (!observations.held_out.empty()) {
    const Seal there = seal_blocks(complete, 0);
    if (!can_be_scored(complete, there, there.sealed)) {
      complete = complete.subset(there.open);
      complete.held_out.clear();
    }
  }
  for (const std::string& name : names) complete.not_usable.erase(name);
  return complete;
}

bool needs_one_of(const Effect& effect, const std::vector<std::string>& names) {
  return std::ranges::any_of(effect.covariates, [&](const std::string& covariate) {
    return std::ranges::find(names, covariate) != names.end();
  });
}

bool is_over_one_of(const UnknownStructure& unknown, const std::vector<std::string>& names) {
  return std::ranges::any_of(
      names, [&](const std::string& name) { return name == unknown.covariate || name == unknown.condition; });
}

/// What was found there that goes with one of them, in words.
std::vector<std::string> found_with(const Explanation& explanation, const std::vector<std::string>& names) {
  std::vector<std::string> found;
  for (const AdoptedEffect& adopted : explanation.adopted)
    if (needs_one_of(*adopted.term.effect, names)) found.push_back(adopted.term.label());
  for (const UnknownStructure& unknown : explanation.unknown)
    if (is_over_one_of(unknown, names)) found.push_back("structure over " + unknown.covariate);
  return found;
}

/// What goes with them there, of which no name can be held against all runs: as structure.
std::vector<UnknownStructure> structure_over(const std::vector<std::string>& names,
                                             const Observations& complete, Explanation there,
                                             std::vector<const Effect*> effects,
                                             const SearchSettings& settings) {
  const bool named = std::ranges::any_of(
      there.adopted, [&](const AdoptedEffect& adopted) { return needs_one_of(*adopted.term.effect, names); });
  std::erase_if(effects, [&](const Effect* effect) { return needs_one_of(*effect, names); });
  if (named) there = explain_once(complete, effects, settings);
  std::erase_if(there.unknown,
                [&](const UnknownStructure& unknown) { return !is_over_one_of(unknown, names); });
  return std::move(there.unknown);
}

}  // namespace

Explanation without_names_of_incomplete(Explanation explanation, const Observations& observations,
                                        const std::vector<const Effect*>& effects,
                                        const SearchSettings& settings, std::vector<std::string>& said) {
  const std::vector<std::string> incomplete = nearly_complete(observations);
  if (incomplete.empty() || explanation.verdict == "insufficient") return explanation;
  const Observations complete = with_all(observations, incomplete);
  if (complete.rows() == 0) return explanation;
  Explanation there = explain_once(complete, effects, settings);
  const std::vector<std::string> found = found_with(there, incomplete);
  if (found.empty()) return explanation;

  const auto is_found_there = [&](const Effect& effect) {
    return std::ranges::any_of(there.adopted, [&](const AdoptedEffect& adopted) {
      return adopted.term.effect->name == effect.name && adopted.term.effect->covariates == effect.covariates;
    });
  };
  std::vector<std::string> gone;
  for (const AdoptedEffect& adopted : explanation.adopted)
    if (!is_found_there(*adopted.term.effect)) gone.push_back(adopted.term.label());
  if (!gone.empty()) {
    std::vector<const Effect*> left;
    for (const Effect* effect : effects)
      if (effect->theory_only || is_found_there(*effect)) left.push_back(effect);
    Explanation again = explain_once(observations, left, settings);
    again.untestable = std::move(explanation.untestable);
    again.seal_chose = true;  // the runs that have all are of sealed blocks as well
    explanation = std::move(again);
  }
  for (UnknownStructure& unknown :
       structure_over(incomplete, complete, std::move(there), effects, settings)) {
    unknown.in_some_runs = true;
    explanation.unknown.push_back(std::move(unknown));
  }
  std::erase_if(explanation.warnings, [&](const std::string& warning) {  // that it cannot be seen
    return std::ranges::any_of(
        incomplete, [&](const std::string& name) { return warning.starts_with(name + " is missing"); });
  });
  explanation.verdict = verdict_of(explanation);
  said.push_back(fmt::format("in the {} of {} {} that have {}, {} is found{}: fill in what is missing",
                             complete.rows(), observations.rows(), observations.from_table ? "rows" : "runs",
                             fmt::join(incomplete, " and "), fmt::join(found, " and "),
                             gone.empty() ? ""
                                          : fmt::format(", and {} is not, which is taken back therefore",
                                                        fmt::join(gone, " and "))));
  return explanation;
}

}  // namespace tunnelrig
