#include "datasets/import_doubts.h"

#include "datasets/locations.h"
#include "datasets/open_space.h"
#include "datasets/plausible.h"
#include "datasets/run_columns.h"
#include "datasets/unit_doubts.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

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

/// An index that another program wrote out, mostly.
void doubt_nameless_columns(const Sheet& sheet, Doubts& doubts) {
  const auto count = std::ranges::count(sheet.columns, "");
  if (count == 0) return;
  doubts.push_back(
      fmt::format("{}:1: {} without a name: kept as it stands, for an exported campaign folder, and read by "
                  "nothing; other exports are without it",
                  sheet.file, count == 1 ? "a column" : fmt::format("{} columns", count)));
}

/// A column that is not read, or in a unit that no effect knows.
void doubt_conditions(const Sheet& sheet, Doubts& doubts) {
  for (const std::string& column : sheet.columns) {
    if (is_made_of_times(column))
      doubts.push_back(fmt::format("{}:1: column {} is not read: that condition is made of the runs' times",
                                   sheet.file, column));
    const std::string_view ours = in_our_unit(column);
    if (!ours.empty() && !sheet.find(ours))
      doubts.push_back(fmt::format(
          "{}:1: column {} is kept as a condition without a meaning: effects read this quantity as {}",
          sheet.file, column, ours));
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

/// A label of the tunnel's that is off its grid: the run would count as one outside.
void doubt_labels_of_places(const CampaignInfo& info, const Sheet& sheet, const std::vector<Run>& runs,
                            Doubts& doubts) {
  if (!info.tunnel) return;
  const auto nowhere = [](const Run& run) {
    return run.kind == RunKind::kThrust && run.excluded.empty() && !run.in_tunnel() && !in_open_space(run);
  };
  const auto first = std::ranges::find_if(runs, nowhere);
  const auto count = std::count_if(first, runs.end(), nowhere);
  if (count == 0) return;
  doubts.push_back(fmt::format(
      "{}:{}: location '{}' is none of the tunnel's grid (H0 to H5, V-3 to V3) nor of open space (OS, GND…, "
      "CEIL…), and has no y_norm and z_norm: {} {} in no tunnel",
      sheet.file, first->line, first->location, count, count == 1 ? "run counts as" : "runs count as"));
}

/// A row that was copied, and its array with it: the same data would count twice.
void doubt_arrays(const Sheet& sheet, const std::vector<Run>& runs, Doubts& doubts) {
  std::map<std::string, const Run*> first;
  for (const Run& run : runs) {
    if (run.raw.empty()) continue;
    const auto [found, fresh] =
        first.emplace(std::filesystem::path(run.raw).lexically_normal().string(), &run);
    if (!fresh)
      doubts.push_back(fmt::format("{}:{}: run {} has the array of run {}, {}: was the row copied?",
                                   sheet.file, run.line, run.run, found->second->run, run.raw));
  }
}

/// Two days under one label, or a clock that jumped: what drifts within a session is measured from its first
/// run.
void doubt_sessions(const Sheet& sheet, const std::vector<Run>& runs, Doubts& doubts) {
  constexpr double kLongest_s = 24 * 3600;
  std::map<std::string, std::pair<const Run*, const Run*>> ends;
  for (const Run& run : runs) {
    auto& [first, last] = ends.try_emplace(run.session, &run, &run).first->second;
    if (run.start_s < first->start_s) first = &run;
    if (run.start_s > last->start_s) last = &run;
  }
  for (const auto& [session, span] : ends) {
    const auto& [first, last] = span;
    if (last->start_s - first->start_s <= kLongest_s) continue;
    doubts.push_back(
        fmt::format("{}:{} and {}:{}: session {} goes on from {} to {}; a session is one set-up on one day: "
                    "are its times right?",
                    sheet.file, first->line, sheet.file, last->line, session, format_utc(first->start_s),
                    format_utc(last->start_s)));
  }
}

/// Runs of one value on end.
struct Stretch {
  std::size_t first = 0, length = 0;
};

/// The longest stretch of a value other than 0 (a fan that is off has no speed).
Stretch longest_stretch(const std::vector<std::pair<const Run*, double>>& read) {
  Stretch longest, current;
  for (std::size_t i = 0; i < read.size(); ++i) {
    const bool goes_on = i > 0 && read[i].second == read[i - 1].second;
    current = goes_on ? Stretch{current.first, current.length + 1} : Stretch{i, 1};
    if (current.length > longest.length && read[i].second != 0) longest = current;
  }
  return longest;
}

/// A reading that has another value in nearly every run, and then no more. What is set has few values.
void doubt_stuck(const Sheet& sheet, const std::vector<Run>& runs, Doubts& doubts) {
  constexpr std::size_t kFewest = 8;   // runs of one value
  constexpr double kMostlyNew = 0.75;  // of the other runs' values
  std::vector<const Run*> in_time;
  std::set<std::string> columns;
  for (const Run& run : runs) {
    if (run.kind != RunKind::kThrust || !run.excluded.empty()) continue;
    in_time.push_back(&run);
    for (const auto& [column, value] : run.numbers) columns.insert(column);
  }
  std::ranges::stable_sort(in_time, {}, &Run::start_s);
  for (const std::string& column : columns) {
    std::vector<std::pair<const Run*, double>> read;
    for (const Run* run : in_time)
      if (const auto value = run->number(column)) read.emplace_back(run, *value);
    const Stretch stuck = longest_stretch(read);
    if (stuck.length < kFewest || read.size() < stuck.length + kFewest) continue;
    std::set<double> values;
    for (const auto& [run, value] : read) values.insert(value);
    if (static_cast<double>(values.size()) < kMostlyNew * static_cast<double>(read.size() - stuck.length))
      continue;
    const auto& [first, value] = read[stuck.first];
    doubts.push_back(fmt::format(
        "{}:{} to {}:{}, column {}: {:g} in {} runs on end, and another value in nearly every other run: was "
        "the sensor stuck?",
        sheet.file, first->line, sheet.file, read[stuck.first + stuck.length - 1].first->line, column, value,
        stuck.length));
  }
}

}  // namespace

std::vector<std::string> import_doubts(const CampaignInfo& info, const Sheet& runs_sheet,
                                       const std::vector<Run>& runs) {
  Doubts doubts = info.unread;
  doubt_columns(runs_sheet, runs, doubts);
  doubt_nameless_columns(runs_sheet, doubts);
  doubt_conditions(runs_sheet, doubts);
  doubt_labels(runs_sheet, runs, doubts);
  const UnitDoubts units = unit_doubts(runs_sheet, runs);
  doubts.insert(doubts.end(), units.sentences.begin(), units.sentences.end());
  const bool cause_said = std::any_of(units.columns.begin(), units.columns.end(), [](const auto& column) {
    return column.starts_with("thrust_") || column == "speed_rpm";
  });
  if (!cause_said) doubt_thrusts(info, runs_sheet, runs, doubts);
  doubt_places(runs_sheet, runs, doubts);
  doubt_labels_of_places(info, runs_sheet, runs, doubts);
  doubt_arrays(runs_sheet, runs, doubts);
  doubt_sessions(runs_sheet, runs, doubts);
  doubt_stuck(runs_sheet, runs, doubts);
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

/// By all frames, since statistics cap the time that gaps may take.
void OverlapDoubt::look_at(const Run& run, const RunStatistics& statistics, std::span<const Gap> gaps) {
  auto frames = static_cast<double>(statistics.frames);
  for (const Gap& gap : gaps) frames += static_cast<double>(gap.frames_lost);
  recordings_.push_back({run.run, run.line, run.start_s, run.start_s + frames / info_.daq.sample_rate_hz});
}

Doubts OverlapDoubt::doubts() const {
  std::vector<Recording> in_time = recordings_;
  std::ranges::stable_sort(in_time, {}, &Recording::start_s);
  std::size_t count = 0;
  std::string first;
  for (std::size_t i = 1; i < in_time.size(); ++i) {
    const Recording &before = in_time[i - 1], &run = in_time[i];
    // Times are often written to the minute, and a run may end as the next begins.
    const double shorter_s = std::min(before.end_s - before.start_s, run.end_s - run.start_s);
    if (before.end_s - run.start_s <= shorter_s / 2 || ++count > 1) continue;
    first = fmt::format(
        "runs.csv:{}: run {} begins {:.4g} s after run {}, which by its frames lasts {:.4g} s: are "
        "daq.sample_rate_hz = {:g} and start_utc right?",
        run.line, run.run, run.start_s - before.start_s, before.run, before.end_s - before.start_s,
        info_.daq.sample_rate_hz);
  }
  if (count == 0) return {};
  return {first + (count > 1 ? fmt::format(" It is so of {} runs", count) : "")};
}

void StuckTareDoubt::look_at(const Run& run, const RunStatistics& statistics) {
  if (run.kind != RunKind::kTare || !run.excluded.empty()) return;
  for (std::size_t c = 0; c < static_cast<std::size_t>(info_.rig.rotors); ++c) {
    const ChannelStatistics& channel = statistics.channels[c];
    if (!channel.stuck()) continue;
    if (++tares_ == 1)
      first_ = fmt::format(
          "runs.csv:{}: run {}: channel {} of {} is stuck at {:g} V for the whole run: `reduce` leaves this "
          "tare out",
          run.line, run.run, c + 1, run.raw, channel.lowest_V);
    return;
  }
}

Doubts StuckTareDoubt::doubts() const {
  if (tares_ == 0) return {};
  return {first_ + (tares_ > 1 ? fmt::format(". It is so of {} tares", tares_) : "")};
}

}  // namespace tunnelrig
