// Conditions that nothing can be found to follow, and pairs of them that cannot be told apart.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/observations/condition_values.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig {

using Eigen::Index;

namespace {

bool is_needed(const std::string& covariate, const std::vector<const Effect*>& effects) {
  return std::ranges::any_of(effects, [&](const Effect* effect) {
    return std::ranges::find(effect->covariates, covariate) != effect->covariates.end();
  });
}

/// Of a column that no effect needs there is structure to find, or not.
void add_structure(const std::string& covariate, const std::string& why, Explanation& explanation) {
  explanation.untestable.push_back({kStructure, fmt::format("{} {}", covariate, why), {covariate}});
}

bool varies_within_groups(const Observations& observations, const Covariate& covariate,
                          const std::vector<int>& rows) {
  std::map<int, double> first;
  for (const int row : rows) {
    const double value = covariate.value(row, 0);
    if (first.emplace(observations.group[static_cast<std::size_t>(row)], value).first->second != value)
      return true;
  }
  return false;
}

/// Why nothing can be found that follows a condition; empty where something can. `named`: an effect has it.
/// `open`: the rows of the search.
std::string unseen(const Observations& observations, const Covariate& covariate, const std::vector<int>& open,
                   bool named) {
  const bool texts = !covariate.labels.empty();
  const std::string row = observations.from_table ? "row" : "run",
                    group = observations.from_table ? "group" : "location";
  const std::vector<int> all = observations.all_rows();
  if (different_values(covariate, all) == 1 || is_constant(covariate))
    return texts ? "" : "is the same in every " + row;
  const int values = different_values(covariate, open);
  if (values == 1) return fmt::format("is the same in every open {}", row);
  if (!varies_within_groups(observations, covariate, all)) return "does not vary within any " + group;
  if (!varies_within_groups(observations, covariate, open))
    return fmt::format("does not vary within any {} in the open {}s", group, row);
  if ((texts || (values == 2 && !named)) && levels_of(observations, covariate, open).empty())
    return "has fewer than two values that three open blocks have, or more than twelve";
  return "";
}

void warn_of_unseen(const Observations& observations, const std::vector<const Effect*>& effects,
                    const std::vector<int>& rows, Explanation& explanation) {
  for (const Covariate& covariate : observations.covariates) {
    if (covariate.derived || covariate.per_channel() || observations.not_usable.contains(covariate.name) ||
        observations.assumed.contains(covariate.name) || covariate.value.array().isNaN().any())
      continue;
    if (const Covariate* number = number_of_texts(observations, covariate)) {
      explanation.warnings.push_back(
          fmt::format("{} has one {} for each of its texts: what goes with them is said of {}",
                      covariate.name, number->name, number->name));
      continue;
    }
    const bool named = is_needed(covariate.name, effects);
    const std::string why = unseen(observations, covariate, rows, named);
    // A schema has to say the diameter, and most tables are of one propeller.
    if (why.empty() || (covariate.name == kDiameter && is_constant(covariate))) continue;
    explanation.warnings.push_back(
        fmt::format("{} {}: nothing can be found that follows it", covariate.name, why));
    if (!named) add_structure(covariate.name, why, explanation);
  }
}

void warn_of_collinear(const Observations& observations, const std::vector<const Effect*>& effects,
                       Explanation& explanation) {
  for (std::size_t a = 0; a < observations.covariates.size(); ++a)
    for (std::size_t b = a + 1; b < observations.covariates.size(); ++b) {
      const Covariate &first = observations.covariates[a], &second = observations.covariates[b];
      if ((first.derived && second.derived) || !first.labels.empty() || !second.labels.empty()) continue;
      if (first.value.array().isNaN().any() || second.value.array().isNaN().any()) continue;
      if (is_constant(first) || is_constant(second)) continue;  // said already
      const double together = correlation(first, second);
      if (std::abs(together) < kCollinear) continue;
      explanation.warnings.push_back(
          fmt::format("{} and {} go together (correlation {:.4f}): effects of the two cannot be told apart",
                      first.name, second.name, together));
      for (const auto& [own, other] : {std::pair(&first, &second), std::pair(&second, &first)})
        if (!own->derived && !is_needed(own->name, effects))
          add_structure(own->name,
                        fmt::format("is collinear with {}: it is sought, but not on its own", other->name),
                        explanation);
      for (const Effect* effect : effects)
        for (const std::string& covariate : effect->covariates)
          if (covariate == second.name || covariate == first.name)
            explanation.untestable.push_back(
                {effect->name,
                 fmt::format("{} is collinear with {}: it is tried, but not on its own", covariate,
                             covariate == first.name ? second.name : first.name),
                 {}});
    }
  std::vector<Untestable> once;
  for (const Untestable& entry : explanation.untestable)
    if (std::none_of(once.begin(), once.end(), [&](const Untestable& u) {
          return u.effect == entry.effect && (u.effect != kStructure || u.missing == entry.missing);
        }))
      once.push_back(entry);
  explanation.untestable = std::move(once);
}

/// Conditions that some runs lack.
void report_incomplete(const Observations& observations, const std::vector<const Effect*>& effects,
                       Explanation& explanation) {
  for (const auto& [covariate, why] : observations.not_usable)
    if (const Covariate* column = observations.find(covariate);
        column != nullptr && !column->derived && !is_needed(covariate, effects))
      add_structure(covariate, "is " + why, explanation);
  for (const auto& [covariate, why] : observations.left_out_for)
    add_structure(covariate, "is " + why, explanation);
}

/// A group of a row or two says little but its own constant, and time goes with the cube of the groups.
void warn_of_many_groups(const Observations& observations, Explanation& explanation) {
  constexpr int kFew = 2, kMany = 50;  // rows of a group, and groups
  if (observations.from_table && observations.groups() > kMany &&
      kFew * observations.groups() > observations.rows())
    explanation.warnings.push_back(
        fmt::format("{} groups for {} rows: most rows are used up by their group's constant; are these "
                    "groups meant?",
                    observations.groups(), observations.rows()));
}

}  // namespace

std::vector<std::string> collinear_with(const Observations& observations, const Covariate& covariate) {
  std::vector<std::string> result;
  if (!covariate.value.allFinite() || is_constant(covariate) || !covariate.labels.empty()) return result;
  const std::vector<int> all = observations.all_rows();
  const auto goes_with = [&](const Covariate& other) {
    if (std::max(std::abs(correlation(covariate, other)), std::abs(rank_correlation(covariate, other))) >=
        kCollinear)
      return true;
    return !covariate.per_channel() && !other.per_channel() &&
           varies_within_groups(observations, other, all) &&
           all_but_tells(observations, all, covariate.value.col(0), other.value.col(0));
  };
  for (const Covariate& other : observations.covariates)
    if (other.name != covariate.name && other.labels.empty() && !(other.derived && covariate.derived) &&
        can_be_followed(observations, other) && goes_with(other))
      result.push_back(other.name);
  return result;
}

void report_unseen_conditions(const Observations& observations, const std::vector<const Effect*>& effects,
                              const std::vector<int>& rows, Explanation& explanation) {
  report_incomplete(observations, effects, explanation);
  warn_of_unseen(observations, effects, rows, explanation);
  warn_of_collinear(observations, effects, explanation);
  warn_of_many_groups(observations, explanation);
}

}  // namespace tunnelrig
