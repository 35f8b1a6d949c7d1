// The protocol done again without what it showed to be wrong: gross rows, conditions far from all others.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/explanation/seal.h"
#include "analysis/residual/likelihood/scores.h"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig {
namespace {

constexpr int kMostSearches = 2;  // after the first, each without the gross rows of the one before

std::vector<int> rows_but(const Observations& observations, const std::vector<SuspectRow>& left_out) {
  std::vector<int> rows;
  for (int r = 0; r < static_cast<int>(observations.rows()); ++r)
    if (std::none_of(left_out.begin(), left_out.end(), [&](const SuspectRow& row) {
          return row.row == observations.name[static_cast<std::size_t>(r)];
        }))
      rows.push_back(r);
  return rows;
}

const std::string& block_of(const Observations& observations, int row) {
  return observations.block_name[static_cast<std::size_t>(observations.block[static_cast<std::size_t>(row)])];
}

/// What is left of the rows, and what is not.
struct SetAside {
  const Observations& all;
  Observations kept;
  std::size_t most;
  std::vector<SuspectRow> rows;

  explicit SetAside(const Observations& given)
      : all(given), kept(all), most(all.name.size() / (all.from_table ? kRowsPerGross : kRunsPerGross)) {}
  std::size_t room() const { return most - std::min(most, rows.size()); }
  /// Whether there is room for them, and what is left differs and has a row that the table holds out.
  bool can_take(const std::vector<SuspectRow>& gross) const {
    if (gross.size() > room()) return false;
    const std::vector<int> left = rows_but(kept, gross);
    const Eigen::MatrixXd value = kept.value(left, Eigen::all);
    return value.maxCoeff() > value.minCoeff() &&
           (kept.held_out.empty() ||
            std::ranges::any_of(left, [&](int row) { return kept.held_out[static_cast<std::size_t>(row)]; }));
  }
  void take(const std::vector<SuspectRow>& gross) {
    kept = kept.subset(rows_but(kept, gross));
    for (SuspectRow row : gross) {
      row.set_aside = true;
      rows.push_back(row);
    }
  }
  void put_back(const SuspectRow& row) {
    std::erase_if(rows, [&](const SuspectRow& each) { return each.row == row.row; });
    kept = all.subset(rows_but(all, rows));
  }
};

/// Whether effects that the other rows have named predict this one as well: it lies where they do most.
bool is_predicted(const Observations& observations, const SuspectRow& row, const MeanModel& model) {
  constexpr double kWithin = 4, kOfBaselines = 0.25;  // standard deviations; of the error without them
  const auto goes_by_other_rows = [](const Term& term) {
    return term.per_group || term.effect->has_change_point();
  };
  if (model.terms.empty() || !model.curves.empty() || std::ranges::any_of(model.terms, goes_by_other_rows))
    return false;
  const std::vector<int> others = rows_but(observations, {row});
  const auto error_of = [&](const MeanModel& tried) {
    return score(observations, fit_jointly(observations, tried, others), others,
                 {place_of(observations, row.row)});
  };
  const HeldOutErrors with = error_of(model), without = error_of({});
  const double error = std::abs(with.error(0, 0));
  return error <= kWithin * with.expected_std(0, 0) && error <= kOfBaselines * std::abs(without.error(0, 0));
}

/// A block of which most rows are set aside has more that is wrong than these.
void warn_of_half_blocks(const Observations& observations, const SetAside& aside,
                         std::vector<std::string>& said) {
  constexpr std::size_t kFewest = 3;
  for (const auto& [block, places] : places_of_each(observations.block)) {
    const auto gone = static_cast<std::size_t>(std::ranges::count_if(places, [&](Eigen::Index r) {
      return std::ranges::any_of(aside.rows, [&](const SuspectRow& row) {
        return row.row == observations.name[static_cast<std::size_t>(r)];
      });
    }));
    if (gone >= kFewest && 2 * gone > places.size() && gone < places.size())
      said.push_back(fmt::format(
          "{} of the {} rows of block {} are set aside, and the rest is likely as wrong: leave the block out",
          gone, places.size(), observations.block_name[static_cast<std::size_t>(block)]));
  }
}

/// The sealed rows that are set aside are in no error, which is smaller for it.
void warn_of_sealed_rows(const SetAside& aside, std::uint64_t seed, std::vector<std::string>& said) {
  const Observations& all = aside.all;
  std::set<std::string> sealed;  // blocks
  if (all.held_out.empty())
    for (const int row : seal_blocks(aside.kept, seed).sealed) sealed.insert(block_of(aside.kept, row));
  const auto count = std::ranges::count_if(aside.rows, [&](const SuspectRow& row) {
    const int place = place_of(all, row.row);
    return all.held_out.empty() ? sealed.contains(block_of(all, place))
                                : static_cast<bool>(all.held_out[static_cast<std::size_t>(place)]);
  });
  if (count > 0)
    said.push_back(fmt::format(
        "{} of the {} that are set aside {} held out: the errors before and after are without {}", count,
        all.from_table ? "rows" : "runs", count == 1 ? "is" : "are", count == 1 ? "it" : "them"));
}

std::string in_words(const IsolatedValue& value, const char* what) {
  return fmt::format("{} of {} is {:.6g}, far from all others ({:.6g} to {:.6g}): {}", value.covariate,
                     value.row, value.value, value.low, value.high, what);
}

std::vector<SuspectRow> rows_of(const std::vector<IsolatedValue>& values) {
  std::vector<SuspectRow> rows;
  for (const IsolatedValue& value : values)
    if (std::none_of(rows.begin(), rows.end(), [&](const SuspectRow& row) { return row.row == value.row; }))
      rows.push_back({value.row, 0});
  return rows;
}

/// A campaign's runs are many, and its conditions are typed by hand: one that is a slip goes with its run. A
/// run whose thrust is far off as well may have been under that condition: it stays, and it is said.
void set_mistyped_aside(SetAside& aside, std::vector<std::string>& said) {
  const std::vector<IsolatedValue> values = mistyped_values(aside.kept);
  std::vector<IsolatedValue> others = isolated_values(aside.kept);
  std::erase_if(others, [&](const IsolatedValue& other) {
    return std::ranges::any_of(values, [&](const IsolatedValue& value) {
      return value.row == other.row && value.covariate == other.covariate;
    });
  });
  const std::vector<SuspectRow> rows = rows_of(values);
  const bool few = aside.can_take(rows);
  if (few) aside.take(rows);
  for (const IsolatedValue& value : values)
    said.push_back(in_words(value, few ? "set aside; a typing error?" : "a typing error?"));
  for (const IsolatedValue& value : others) said.push_back(in_words(value, "a typing error?"));
}

/// A condition far from all others is said. Where the model found with such rows predicts worse than none, it
/// is found without them.
Explanation without_isolated(Explanation explanation, SetAside& aside,
                             const std::vector<const Effect*>& effects, const SearchSettings& settings,
                             std::vector<std::string>& said) {
  const std::vector<IsolatedValue> isolated = isolated_values(aside.kept);
  if (isolated.empty()) return explanation;
  const bool misled = explanation.after.held_out_rmse > explanation.before.held_out_rmse;
  const std::vector<SuspectRow> rows = rows_of(isolated);
  const bool aside_too = misled && aside.can_take(rows);
  if (aside_too) {
    aside.take(rows);
    explanation = explain_once(aside.kept, effects, settings);
    explanation.seal_chose = true;
  }
  for (const IsolatedValue& value : isolated)
    said.push_back(in_words(value, aside_too
                                       ? "set aside, since the model found with it predicted worse than none"
                                       : "a typing error?"));
  return explanation;
}

}  // namespace

Observations without_set_aside(const Observations& observations, const Explanation& explanation) {
  std::vector<SuspectRow> aside;
  for (const SuspectRow& row : explanation.suspect_rows)
    if (row.set_aside) aside.push_back(row);
  Observations result = aside.empty() ? observations : observations.subset(rows_but(observations, aside));
  result.scatter = explanation.scatter;
  return result;
}

Explanation explain(const Observations& observations, const std::vector<const Effect*>& effects,
                    const SearchSettings& settings) {
  // A gross error hides what else is there: it is set aside, and said.
  SetAside aside(observations);
  std::vector<std::string> said = blocks_apart(observations);
  auto lone = lone_row(aside.kept);
  if (lone && !aside.can_take({*lone})) lone.reset();
  if (lone) aside.take({*lone});
  while (const auto row = gross_row(aside.kept)) {
    if (!aside.can_take({*row})) break;
    aside.take({*row});
  }
  if (!observations.from_table) {
    set_mistyped_aside(aside, said);
    if (const auto wild = wild_runs(aside.kept); aside.can_take(wild)) aside.take(wild);
  }
  Explanation explanation = explain_once(aside.kept, effects, settings);
  if (lone && is_predicted(observations, *lone, explanation.model)) {
    aside.put_back(*lone);
    explanation = explain_once(aside.kept, effects, settings);
  }
  for (int again = 0; again < kMostSearches; ++again) {
    const std::vector<SuspectRow> gross = gross_rows(aside.kept, explanation.suspect_rows);
    if (gross.empty()) break;
    if (gross.size() > aside.room()) {  // many are no typing errors: the model is wrong
      said.push_back(
          fmt::format("{} {} are far off, more than are set aside ({} at most{}): what scatters like them "
                      "hides the rest; look at suspect_rows, and leave out what is wrong",
                      gross.size(), observations.from_table ? "rows" : "runs", aside.most,
                      aside.rows.empty() ? "" : fmt::format(", and {} are", aside.rows.size())));
      break;
    }
    if (!aside.can_take(gross)) break;
    aside.take(gross);
    explanation = explain_once(aside.kept, effects, settings);
  }
  warn_of_half_blocks(observations, aside, said);
  if (observations.from_table)
    explanation = without_isolated(std::move(explanation), aside, effects, settings, said);
  std::vector<const Effect*> left = effects;
  SearchSettings unrefuted = settings;
  explanation = without_refuted(std::move(explanation), aside.kept, left, unrefuted, said);
  explanation = without_names_of_incomplete(std::move(explanation), aside.kept, left, unrefuted, said);
  explanation.seal_chose = explanation.seal_chose && !explanation.adopted.empty();
  if (explanation.seal_chose)
    said.emplace_back(
        "the sealed blocks had a part in what is adopted: their error after is no longer one of "
        "blocks that nobody has looked at");
  if (explanation.verdict != "insufficient") warn_of_sealed_rows(aside, settings.seed, said);
  explanation.warnings.insert(explanation.warnings.begin(), said.begin(), said.end());
  explanation.suspect_rows.insert(explanation.suspect_rows.begin(), aside.rows.begin(), aside.rows.end());
  return explanation;
}

}  // namespace tunnelrig
