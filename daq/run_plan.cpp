#include "daq/run_plan.h"

#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/run_columns.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <string_view>

#include <fmt/ranges.h>

namespace tunnelrig {
namespace {

/// Some repeats at one location, one after the other: moving the rig takes longer than a run.
struct Visit {
  PlannedLocation location;
  std::vector<int> repeats;
};

void check(const PlanSettings& settings) {
  if (settings.repeats < 2)
    throw InputError(fmt::format("--repeats {}: at least 2, or there is no scatter", settings.repeats));
  if (settings.visits < 2 || settings.visits > settings.repeats) {
    throw InputError(
        fmt::format("--visits {}: from 2 (or sessions and locations cannot be told apart) to the {} repeats",
                    settings.visits, settings.repeats));
  }
  if (settings.runs_per_session < 4) throw InputError("--runs-per-session: at least 4");
  // Else sessions would be left over when each visit has one, and a session without a visit stands nowhere.
  if (const int visit = 1 + (settings.repeats - 1) / settings.visits; visit > settings.runs_per_session)
    throw InputError(fmt::format(
        "--runs-per-session {}: a visit to a location is {} runs in a row (--repeats {}, --visits "
        "{}) and belongs to one session",
        settings.runs_per_session, visit, settings.repeats, settings.visits));
  if (!(settings.duration_s > 0 && settings.duration_s <= kLongestRun_s))
    throw InputError(
        fmt::format("--duration {:g}: seconds, above 0, at most {:g}", settings.duration_s, kLongestRun_s));
}

/// Deals every location's visits out to as many different sessions, each time the emptiest ones, ties by
/// chance; so sessions fill evenly and hang together through many pairs of locations.
std::vector<std::vector<Visit>> assign_visits(std::vector<PlannedLocation> locations,
                                              const PlanSettings& settings, std::mt19937_64& engine) {
  const auto visits = static_cast<std::size_t>(settings.visits);
  const std::size_t runs = locations.size() * static_cast<std::size_t>(settings.repeats);
  const auto per_session = static_cast<std::size_t>(settings.runs_per_session);
  std::vector<std::vector<Visit>> sessions(std::max((runs + per_session - 1) / per_session, visits));
  std::vector<std::size_t> order(sessions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(locations.begin(), locations.end(), engine);
  for (const PlannedLocation& location : locations) {
    std::shuffle(order.begin(), order.end(), engine);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return sessions[a].size() < sessions[b].size(); });
    for (std::size_t v = 0; v < visits; ++v) {
      Visit visit{location, {}};
      for (auto repeat = static_cast<int>(v) + 1; repeat <= settings.repeats; repeat += settings.visits) {
        visit.repeats.push_back(repeat);
      }
      sessions[order[v]].push_back(visit);
    }
  }
  for (auto& session : sessions) std::shuffle(session.begin(), session.end(), engine);
  return sessions;
}

class PlanWriter {
 public:
  explicit PlanWriter(const PlanSettings& settings) : settings_(settings) {}

  void add_sessions(const std::vector<PlannedLocation>& locations, const std::string& anchor,
                    std::mt19937_64& engine) {
    if (locations.empty()) return;
    for (const auto& visits : assign_visits(locations, settings_, engine)) add_session(visits, anchor);
  }

  std::vector<PlannedRun> take() { return std::move(plan_); }

 private:
  void add_session(const std::vector<Visit>& visits, const std::string& anchor) {
    session_ = fmt::format("S{}", ++sessions_);
    add_tare(visits.front().location.label, 1);
    int since_anchor = 0;
    if (settings_.anchor_every > 0) add_anchor(anchor);
    for (const Visit& visit : visits) {
      for (const int repeat : visit.repeats) {
        if (settings_.anchor_every > 0 && since_anchor == settings_.anchor_every) {
          add_anchor(anchor);
          since_anchor = 0;
        }
        plan_.push_back({session_, RunKind::kThrust, visit.location.label, repeat, settings_.duration_s,
                         visit.location.y_norm, visit.location.z_norm});
        ++since_anchor;
      }
    }
    add_tare(visits.back().location.label, 2);
  }

  void add_tare(const std::string& location, int repeat) {
    plan_.push_back({session_, RunKind::kTare, location, repeat, settings_.duration_s, {}, {}});
  }

  /// Anchors are repeats of their location beyond the planned ones.
  void add_anchor(const std::string& anchor) {
    const int repeat = settings_.repeats + ++anchors_[anchor];
    plan_.push_back({session_, RunKind::kThrust, anchor, repeat, settings_.duration_s, {}, {}});
  }

  const PlanSettings& settings_;
  std::vector<PlannedRun> plan_;
  std::string session_;
  int sessions_ = 0;
  std::map<std::string, int> anchors_;
};

/// Coordinates that no run sheet can hold would make every run of the file unreadable.
std::optional<double> coordinate(const Sheet& sheet, std::size_t row, const char* column) {
  const auto value = sheet.number(row, column);
  if (!value) return {};
  if (const std::string why = outside_range(column, *value); !why.empty())
    throw InputError(fmt::format("{}: {}", sheet.where(row, column), why));
  return value;
}

void check_both_or_neither(const Sheet& sheet, std::size_t row, std::optional<double> y_norm,
                           std::optional<double> z_norm) {
  if (y_norm.has_value() != z_norm.has_value())
    throw InputError(fmt::format("{}: one of y_norm and z_norm is missing", sheet.place(row)));
}

constexpr std::array<std::string_view, 7> kPlanColumns = {"session",    "kind",   "location", "repeat",
                                                          "duration_s", "y_norm", "z_norm"};

/// What a recording finds out by itself, or by options: a plan's word for it is no measurement.
constexpr std::array<std::string_view, 12> kFilledIn = {"run",
                                                        "start_utc",
                                                        "raw",
                                                        "source",
                                                        "excluded",
                                                        "alarms",
                                                        "speed_rpm",
                                                        "time_since_motor_start_s",
                                                        "air_temperature_C",
                                                        "air_pressure_Pa",
                                                        "relative_humidity",
                                                        "supply_voltage_V"};

bool is_filled_in(std::string_view column) { return std::ranges::count(kFilledIn, column) > 0; }

bool is_own(std::string_view column) {
  return !column.empty() && !is_filled_in(column) && std::ranges::count(kPlanColumns, column) == 0;
}

/// Where other runs of the file have numbers, "NaN" could not be read among them.
std::vector<std::pair<std::string, std::string>> own_cells(const Sheet& sheet, std::size_t row) {
  std::vector<std::pair<std::string, std::string>> cells;
  for (const std::string& column : sheet.columns) {
    if (!is_own(column)) continue;
    const std::string& cell = sheet.text(row, column);
    cells.emplace_back(column, stands_for_no_number(cell) ? "" : cell);
  }
  return cells;
}

/// Once recorded, a cell that no run sheet can hold would make every run of the file unreadable.
void check_as_runs(Sheet sheet) {
  for (std::string& column : sheet.columns)
    if (is_filled_in(column)) column.clear();  // not stored, so not to be checked
  for (const char* column : {"run", "start_utc", "raw"}) sheet.ensure(column);
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    auto cell = sheet.rows[row].cells.end() - 3;
    *cell++ = fmt::format("{}", row);
    *cell++ = "2000-01-01T00:00:00Z";
    *cell = "any";
  }
  parse_runs(sheet, {});
}

}  // namespace

PlanSettings thesis_plan() {
  PlanSettings settings;
  for (const std::string& label : tunnel_grid()) settings.tunnel.push_back({label, {}, {}});
  for (const std::string& label : open_space_grid()) settings.open_space.push_back({label, {}, {}});
  return settings;
}

std::vector<PlannedRun> make_plan(const PlanSettings& settings) {
  check(settings);
  if (settings.tunnel.empty() && settings.open_space.empty())
    throw InputError("there is no location to plan for");
  std::mt19937_64 engine(settings.seed);
  PlanWriter writer(settings);
  writer.add_sessions(settings.tunnel, "OT", engine);
  writer.add_sessions(settings.open_space, "OS", engine);
  return writer.take();
}

Sheet plan_sheet(const std::vector<PlannedRun>& plan) {
  Sheet sheet{.file = "",
              .columns = {"session", "kind", "location", "repeat", "duration_s", "y_norm", "z_norm"},
              .rows = {}};
  const auto optional_text = [](std::optional<double> value) {
    return value ? fmt::format("{}", *value) : std::string();
  };
  for (const PlannedRun& run : plan) {
    sheet.rows.push_back({{run.session, run.kind == RunKind::kTare ? "tare" : "thrust", run.location,
                           fmt::format("{}", run.repeat), fmt::format("{:g}", run.duration_s),
                           optional_text(run.y_norm), optional_text(run.z_norm)},
                          0});
  }
  return sheet;
}

std::vector<PlannedRun> parse_plan(const Sheet& sheet) {
  std::vector<PlannedRun> plan;
  std::set<RunKey> seen;
  for (const char* column : {"session", "location", "repeat"}) sheet.require(column);
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    PlannedRun run;
    run.session = sheet.text(row, "session");
    run.location = sheet.text(row, "location");
    if (run.session.empty() || run.location.empty()) {
      throw InputError::at(sheet.file, sheet.rows[row].line, "session and location must not be empty");
    }
    const std::string& kind = sheet.text(row, "kind");
    if (!kind.empty() && kind != "thrust" && kind != "tare") {
      throw InputError(fmt::format("{}: '{}' is neither thrust nor tare", sheet.where(row, "kind"), kind));
    }
    run.kind = kind == "tare" ? RunKind::kTare : RunKind::kThrust;
    run.repeat = sheet.require_integer(row, "repeat", 0, std::numeric_limits<int>::max());
    run.duration_s = sheet.number(row, "duration_s").value_or(run.duration_s);
    if (run.duration_s <= 0 || run.duration_s > kLongestRun_s) {
      throw InputError(
          fmt::format("{}: {:g} s is no duration of a run", sheet.where(row, "duration_s"), run.duration_s));
    }
    run.y_norm = coordinate(sheet, row, "y_norm");
    run.z_norm = coordinate(sheet, row, "z_norm");
    check_both_or_neither(sheet, row, run.y_norm, run.z_norm);
    if (!seen.insert(key_of(run)).second) {
      throw InputError::at(sheet.file, sheet.rows[row].line, "session {}, {} {}, repeat {} is planned twice",
                           run.session, kind.empty() ? "thrust" : kind, run.location, run.repeat);
    }
    run.own = own_cells(sheet, row);
    plan.push_back(std::move(run));
  }
  check_as_runs(sheet);
  if (plan.empty()) throw InputError::in(sheet.file, "plans no run");
  return plan;
}

std::vector<std::string> plan_doubts(const Sheet& sheet) {
  std::vector<std::string> filled_in, doubts;
  for (const std::string& column : sheet.columns)
    if (is_filled_in(column)) filled_in.push_back(column);
  if (!filled_in.empty())
    doubts.push_back(fmt::format("{}:1: not stored: {}; a recording fills that in by itself or by options",
                                 sheet.file, fmt::join(filled_in, ", ")));
  for (const std::string& column : sheet.columns)
    if (const std::string_view known = known_but_for_case(column); !known.empty())
      doubts.push_back(fmt::format("{}:1: column '{}' is kept as the runs' own; is '{}' meant?", sheet.file,
                                   column, known));
  if (std::ranges::count(sheet.columns, "") > 0)
    doubts.push_back(fmt::format("{}:1: not stored: a column without a name", sheet.file));
  return doubts;
}

std::vector<PlannedLocation> parse_locations(const Sheet& sheet) {
  sheet.require("location");
  std::vector<PlannedLocation> locations;
  std::map<std::string, int> lines;  // of the locations by their canonical labels
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    PlannedLocation location{sheet.text(row, "location"), coordinate(sheet, row, "y_norm"),
                             coordinate(sheet, row, "z_norm")};
    if (location.label.empty())
      throw InputError(fmt::format("{}: must not be empty", sheet.where(row, "location")));
    check_both_or_neither(sheet, row, location.y_norm, location.z_norm);
    const auto [first, is_new] = lines.emplace(canonical_location(location.label), sheet.rows[row].line);
    if (!is_new) {  // its runs would be planned twice, which no plan may
      throw InputError(
          fmt::format("{}: '{}' is a location of line {} already; --repeats says how many runs each gets",
                      sheet.where(row, "location"), location.label, first->second));
    }
    locations.push_back(location);
  }
  if (locations.empty()) throw InputError::in(sheet.file, "names no location");
  return locations;
}

}  // namespace tunnelrig
