// A plan of runs: what is measured when, written by `plan`, walked by `log --plan`.
#pragma once

#include "datasets/campaign.h"
#include "datasets/csv.h"

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace tunnelrig {

/// Beyond a day or so a duration is a slip of the pen, and its frames would outgrow their count.
inline constexpr double kLongestRun_s = 1e5;

struct PlannedRun {
  std::string session;
  RunKind kind = RunKind::kThrust;
  std::string location;  // of a tare: where the rig stands
  int repeat = 1;
  double duration_s = 60;
  std::optional<double> y_norm, z_norm;
  std::vector<std::pair<std::string, std::string>> own = {};  // columns of the user's, by name: cell
};

/// What tells runs apart: session, kind, location, repeat.
using RunKey = std::tuple<std::string, RunKind, std::string, int>;
template <class SomeRun>
RunKey key_of(const SomeRun& run) {
  return {run.session, run.kind, run.location, run.repeat};
}

/// A location to plan for; coordinates only where the label does not say them.
struct PlannedLocation {
  std::string label;
  std::optional<double> y_norm, z_norm;
};

struct PlanSettings {
  std::vector<PlannedLocation> tunnel;      // empty: the thesis's 42
  std::vector<PlannedLocation> open_space;  // OS, GND…, CEIL…
  int repeats = 10;
  int visits = 2;             // sessions over which a location's repeats are spread, at least 2
  int runs_per_session = 40;  // as many as fit a day
  int anchor_every = 6;       // runs between two returns to the anchor; 0: no anchors
  double duration_s = 60;
  std::uint64_t seed = 1;
};

/// The thesis's programme: 42 tunnel locations, OS, GND and CEIL.
PlanSettings thesis_plan();

/// Lays the runs out in sessions. Each session begins and ends with a tare; after every `anchor_every` runs
/// the rig returns to the anchor (OT in the tunnel, OS in open space), so that drift within a session shows;
/// locations follow in random order, and each one's repeats are spread over `visits` sessions, so that what
/// changes from day to day is not taken for the location. Tunnel and open space never share a session. Throws
/// InputError for settings that cannot be met.
std::vector<PlannedRun> make_plan(const PlanSettings& settings);

Sheet plan_sheet(const std::vector<PlannedRun>& plan);

/// Columns beyond a plan's are the runs' own, but for those that a recording fills in. Throws InputError
/// naming file, line and column, for a run planned twice, and for what no run sheet could hold.
std::vector<PlannedRun> parse_plan(const Sheet& sheet);

/// What of a plan is not stored, in sentences: columns that a recording fills in, or without a name.
std::vector<std::string> plan_doubts(const Sheet& sheet);

/// A user's own locations: a CSV with `location` and, where the label is not of the thesis's grid, `y_norm`
/// and `z_norm`. Throws InputError naming file, line and column, and for a location named twice.
std::vector<PlannedLocation> parse_locations(const Sheet& sheet);

}  // namespace tunnelrig
