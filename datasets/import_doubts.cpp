#include "datasets/import_doubts.h"

#include "datasets/locations.h"
#include "datasets/plausible.h"
#include "datasets/run_columns.h"
#include "datasets/unit_doubts.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Doubts = std::vector<std::string>;

/// A column that is a label because of a few cells.
void doubt_labels(const Sheet& sheet, const std::vector<Run>& runs, Doubts& doubts) {
  constexpr std::size_t kNumbersPerText = 4;
  std::map<std::string, std::size_t> texts, numbers, first;
  for (const Run& run : runs)
    for (const auto& [column, cell] : run.labels) {
      const bool number = parse_number(cell).has_value();
      ++(number ? numbers : texts)[column];
      if (!number) first.emplace(column, run.row);
    }
  for (const auto& [column, count] : texts)
    if (numbers[column] >= kNumbersPerText * count)
      doubts.push_back(fmt::format(
          "{}: '{}' is no number, as {} other cells are: the whole column is kept as text",
          sheet.where(first.at(column), column), sheet.text(first.at(column), column), numbers[column]));
}

/// A column that is one of ours but for capitals, so that nothing reads it.
void doubt_columns(const Sheet& sheet, const std::vector<Run>& runs, Doubts& doubts) {
  for (const std::string& column : sheet.columns) {
    const std::string_view known = known_but_for_case(column);
    if (known.empty()) continue;
    const bool numbers =
        std::any_of(runs.begin(), runs.end(), [&](const Run& run) { return run.numbers.contains(column); });
    doubts.push_back(fmt::format("{}:1: column '{}' is kept as a {}; is '{}' meant?", sheet.file, column,
                                 numbers ? "covariate" : "label", known));
  }
}

/// Thrusts in grams, or of another rotor.
void doubt_thrusts(const CampaignInfo& info, const Sheet& sheet, const std::vector<Run>& runs,
                   Doubts& doubts) {
  for (const Run& run : runs) {
    const double largest_N =
        most_rotor_thrust_N(info.rig, run.number("speed_rpm").value_or(info.rig.nominal_speed_rpm));
    for (int rotor = 0; rotor < info.rig.rotors; ++rotor) {
      const auto thrust_N = run.thrust_N[static_cast<std::size_t>(rotor)];
      if (!thrust_N || !(largest_N > 0) || std::abs(*thrust_N) <= largest_N) continue;
      doubts.push_back(
          fmt::format("{}: {:g} N is more than a rotor of {:g} m radius gives at this speed "
                      "({:.3g} N at most): are these newtons?",
                      sheet.where(run.row, fmt::format("thrust_{}_N", rotor + 1)), *thrust_N,
                      info.rig.propeller_radius_m, largest_N));
      return;  // one says it for all
    }
  }
}

void doubt_places(const Sheet& sheet, const std::vector<Run>& runs, Doubts& doubts) {
  std::map<std::string, const Run*> first;
  for (const Run& run : runs) {
    if (run.kind != RunKind::kThrust) continue;
    const auto [found, fresh] = first.emplace(canonical_location(run.location), &run);
    if (found->second->y_norm == run.y_norm && found->second->z_norm == run.z_norm) continue;
    doubts.push_back(fmt::format("{}:{}: location {} stands elsewhere than in run {}: it cannot be reduced",
                                 sheet.file, run.line, run.location, found->second->run));
    return;
  }
}

}  // namespace

std::vector<std::string> import_doubts(const CampaignInfo& info, const Sheet& runs_sheet,
                                       const std::vector<Run>& runs) {
  Doubts doubts = info.unread;
  doubt_columns(runs_sheet, runs, doubts);
  doubt_labels(runs_sheet, runs, doubts);
  const UnitDoubts units = unit_doubts(runs_sheet, runs);
  doubts.insert(doubts.end(), units.sentences.begin(), units.sentences.end());
  const bool cause_said = std::any_of(units.columns.begin(), units.columns.end(), [](const auto& column) {
    return column.starts_with("thrust_") || column == "speed_rpm";
  });
  if (!cause_said) doubt_thrusts(info, runs_sheet, runs, doubts);
  doubt_places(runs_sheet, runs, doubts);
  return doubts;
}

void VoltDoubt::look_at(const Run& run, const RawFormat& format, const RunStatistics& statistics) {
  if (is_counts(format.type)) return;  // beyond their range they are refused
  for (std::size_t c = 0; c < static_cast<std::size_t>(info_.rig.rotors); ++c) {
    const ChannelStatistics& channel = statistics.channels[c];
    const double furthest_V =
        std::abs(channel.lowest_V) > std::abs(channel.highest_V) ? channel.lowest_V : channel.highest_V;
    if (!beyond_converter(info_.daq, furthest_V)) continue;
    if (++runs_ == 1)
      first_ = fmt::format(
          "runs.csv:{}: run {}: channel {} of {} holds {:g} V, beyond the converter's reference of {:g} V "
          "(daq.adc_reference_V): are these volts (not counts or mV)?",
          run.line, run.run, c + 1, run.raw, furthest_V, info_.daq.adc_reference_V);
    return;
  }
}

Doubts VoltDoubt::doubts() const {
  if (runs_ == 0) return {};
  return {first_ + (runs_ > 1 ? fmt::format(" It is so in {} runs", runs_) : "")};
}

}  // namespace tunnelrig
