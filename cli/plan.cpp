#include "cli/console.h"
#include "cli/verb.h"
#include "daq/run_plan.h"
#include "datasets/csv.h"
#include "datasets/locations.h"

#include <memory>
#include <set>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

struct PlanOptions {
  std::string out;
  std::string locations;
  bool tunnel_only = false;
  PlanSettings settings;
};

int plan_runs(PlanOptions options) {
  PlanSettings settings = thesis_plan();
  if (!options.locations.empty()) {
    settings.tunnel.clear();
    settings.open_space.clear();
    for (const PlannedLocation& location : parse_locations(read_csv(options.locations))) {
      const bool in_tunnel = location.y_norm || grid_point(location.label);
      (in_tunnel ? settings.tunnel : settings.open_space).push_back(location);
    }
  }
  if (options.tunnel_only) settings.open_space.clear();
  options.settings.tunnel = settings.tunnel;
  options.settings.open_space = settings.open_space;
  const std::vector<PlannedRun> plan = make_plan(options.settings);
  const std::string csv = format_csv(plan_sheet(plan));
  if (options.out.empty()) {
    fmt::print("{}", csv);
    return kWell;
  }
  write_text(options.out, csv);
  std::set<std::string> sessions;
  double seconds = 0;
  for (const PlannedRun& planned : plan) {
    sessions.insert(planned.session);
    seconds += planned.duration_s;
  }
  fmt::print("{}: {} runs in {} sessions, {} of recording\n", options.out, plan.size(), sessions.size(),
             duration_text(seconds));
  return kWell;
}

}  // namespace

void add_plan(CLI::App& app, Work& work) {
  auto options = std::make_shared<PlanOptions>();
  CLI::App* verb = app.add_subcommand("plan", "Write a plan of runs for `log --plan`");
  verb->footer(
      "Without --locations: the thesis's programme, 42 tunnel locations, OS, GND and CEIL, ten repeats "
      "each.\n"
      "Each session begins and ends with a tare and returns to its anchor (OT, in open space OS) every six "
      "runs.\n\n"
      "Example: tunnelrig plan --out plan.csv --repeats 6 --seed 3");
  verb->add_option("--out", options->out, "CSV file to write (standard output)");
  verb->add_option(
      "--locations", options->locations,
      "CSV of your own locations: location, and y_norm, z_norm where the label does not say them");
  verb->add_option("--repeats", options->settings.repeats, "Runs at each location")->capture_default_str();
  verb->add_option("--visits", options->settings.visits,
                   "Sessions over which a location's repeats are spread")
      ->capture_default_str();
  verb->add_option("--runs-per-session", options->settings.runs_per_session, "As many as fit a day")
      ->capture_default_str();
  verb->add_option("--anchor-every", options->settings.anchor_every,
                   "Runs between two returns to the anchor, 0: none")
      ->capture_default_str();
  verb->add_option("--duration", options->settings.duration_s, "Seconds of each run")->capture_default_str();
  verb->add_option("--seed", options->settings.seed, "Of the random order")->capture_default_str();
  verb->add_flag("--tunnel-only", options->tunnel_only, "Leave open space (OS, GND, CEIL) out");
  verb->callback([options, &work] { work = [options] { return plan_runs(*options); }; });
}

}  // namespace tunnelrig::cli
