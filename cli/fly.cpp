// tunnelrig fly: controllers through the thesis's scenarios in the simulated tunnel.
#include "cli/console.h"
#include "cli/fly_folder.h"
#include "cli/fly_output.h"
#include "cli/verb.h"
#include "datasets/csv.h"
#include "datasets/error.h"
#include "datasets/output_place.h"
#include "flight/tuning/tuner.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig::cli {
namespace {

struct FlyOptions {
  std::string map, tunnel, scenario = "circle", gains, json, out, tune, position = "lidar";
  std::vector<std::string> controllers;
  int runs = 20, workers = 0, budget = TuningSettings{}.budget;
  std::uint64_t seed = 1;
  double lidar_sigma_mm = 10;
  std::vector<double> blind_s;  // from, to
  HiddenTruth hidden;
};

struct NamedMap {
  DisturbanceMap map;
  std::string name;
};

NamedMap map_of(const FlyOptions& options) {
  if (options.map.empty())
    return {published_disturbance_map(), "published_field (simulated; no measured map was given)"};
  NamedMap measured{read_disturbance_map(options.map), options.map};
  if (!measured.map.delta_ct.u95_known() || !measured.map.uneven_thrust.u95_known())
    warn(options.map +
         ": the map's uncertainty is not known in places; no errors of the map are flown there");
  return measured;
}

std::vector<std::string> controllers_of(const FlyOptions& options) {
  if (!options.controllers.empty()) return options.controllers;
  std::vector<std::string> names;
  for (const ControllerKind& kind : controller_kinds()) names.emplace_back(kind.name);
  return names;
}

struct PlaceAndPath {
  std::string tunnel, scenario;
};

std::vector<PlaceAndPath> programme_of(const FlyOptions& options) {
  if (options.scenario != "all") {
    std::string tunnel = options.tunnel;
    if (tunnel.empty()) tunnel = tunnel_of_scenario(options.scenario);
    return {{tunnel.empty() ? "1.5" : tunnel, options.scenario}};
  }
  if (!options.tunnel.empty())
    throw InputError("--scenario all flies in the thesis's tunnels: --tunnel does not go with it");
  return {{"2.4", "hover"},  {"2.4", "diagonal"}, {"2.4", "ladder"},
          {"2.4", "circle"}, {"1.5", "circle"},   {"railway", "waypoints"}};
}

/// That the results have somewhere to go, before they take hours.
void check_places(const FlyOptions& options) {
  check_distinct({{"--map", options.map},
                  {"--gains", options.gains},
                  {"--json", options.json},
                  {"--out", options.out},
                  {"--tune", options.tune}});
  for (const std::string& path : {options.json, options.tune})
    if (!path.empty()) check_can_be_written(path);
}

/// Everything that can be refused, before anything is flown or printed.
void check_all(const FlyOptions& options, const std::vector<PlaceAndPath>& wanted, const GainTable& gains) {
  const std::vector<std::string> names = controllers_of(options);
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (std::find(names.begin(), name, *name) != name)
      throw InputError(fmt::format("--controllers: {} is named twice", *name));
    AnyController(*name, gains, {});
  }
  const Airframe frame;
  for (const PlaceAndPath& one : wanted) {
    const FlightSpace space(tunnel_from(one.tunnel), frame);
    scenario_from(one.scenario, space, frame);
  }
}

/// One vehicle that is as it is believed to be but for what is hidden, flown again and again: each flight has
/// its own air and sensors.
std::vector<FlightLog> identification_flights(FlightTask task, const std::string& controller,
                                              const GainTable& gains) {
  constexpr int kMost = 12;
  task.spread.mass = task.spread.rotor_thrust = task.spread.map_errors = 0;
  std::vector<FlightLog> flights;
  for (int run = 0; run < std::min(task.runs, kMost); ++run)
    flights.push_back(fly_logged(task, controller, gains, run));
  return flights;
}

/// Flies one scenario; `gains` and `map` are shared by all. `out`: null where nothing is kept.
FlownScenario fly_scenario(const FlyOptions& options, const PlaceAndPath& one, const NamedMap& map,
                           const GainTable& gains, const Processes& processes, FlightsFolder* out) {
  const Airframe frame;
  const FlightSpace space(tunnel_from(one.tunnel), frame);
  const Scenario scenario = scenario_from(one.scenario, space, frame);
  FlightTask task{
      .space = &space, .scenario = &scenario, .map = &map.map, .believed = frame, .hidden = options.hidden};
  task.runs = options.runs;
  task.workers = options.workers;
  task.processes = &processes;
  task.seed = options.seed;
  if (options.position == "given") {
    task.localisation.reset();
  } else {
    task.localisation->lidar.range_sigma_m = 1e-3 * options.lidar_sigma_mm;
    if (options.position == "lidar-thesis") task.localisation->filter = FlightFilter::thesis;
    if (!options.blind_s.empty()) {
      task.localisation->blind_from_s = options.blind_s[0];
      task.localisation->blind_to_s = options.blind_s[1];
    }
  }
  FlownScenario flown{.tunnel = space.tunnel.name,
                      .scenario = scenario.name,
                      .extrapolated = extrapolation(map.map.geometry, space, frame)};
  if (!flown.extrapolated.empty()) warn("extrapolated, in normalised coordinates: " + flown.extrapolated);
  const std::vector<std::string> names = controllers_of(options);
  ProgressBar progress("flying");
  for (std::size_t i = 0; i < names.size(); ++i) {
    flown.controllers.push_back(fly_runs(task, names[i], gains, [&](int done) {
      progress.show(static_cast<double>(i) * options.runs + done,
                    static_cast<double>(names.size()) * options.runs, names[i]);
    }));
    if (out == nullptr) continue;
    flown.logs.push_back(fly_logged(task, names[i], gains));
    flown.identification.push_back(identification_flights(task, names[i], gains));
  }
  if (out != nullptr) {
    std::string warning;
    out->add(options.scenario == "all" ? scenario_folder(flown.tunnel, flown.scenario) : "", flown, task,
             warning);
    if (!warning.empty()) warn(warning);
    flown.for_report = flight_for_report(flown, task, map.name);
    flown.logs.clear();
    flown.identification.clear();
  }
  return flown;
}

/// Those named have gains that can be tuned.
void check_tuned(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    AnyController(name, {}, {});  // says which there are
    const auto kinds = controller_kinds();
    const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](const auto& k) { return k.name == name; });
    if (!kind->tuned)
      throw InputError(
          fmt::format("--tune: {} flies with the gains of its source, which are not tuned", name));
  }
}

/// A file of gains is written anew: those of controllers that are not tuned now would be gone.
void check_none_lost(const FlyOptions& options) {
  if (options.controllers.empty() || !std::filesystem::exists(options.tune)) return;
  for (const auto& [name, gains] : parse_gains(read_text(options.tune), options.tune))
    if (std::ranges::count(options.controllers, name) == 0)
      throw InputError(
          fmt::format("{}: has gains of {}, which are not tuned now and would be lost; write to another file",
                      options.tune, name));
}

/// What would be left out in silence.
void refuse_unused(const FlyOptions& options, const CLI::App& verb) {
  if (!options.tune.empty())
    refuse_given(verb,
                 {"--json", "--out", "--gains", "--scenario", "--tunnel", "--runs", "--seed", "--position",
                  "--lidar-sigma-mm", "--blind-s", "--payload-kg", "--map-scale", "--wind-m-s", "--gust-m-s",
                  "--motor-loss", "--weak-rotor"},
                 "does not go with --tune, which flies the same flights whatever is said of them, and writes "
                 "gains alone; fly with --gains afterwards");
  else
    refuse_given(verb, {"--budget"}, "is of tuning; it goes with --tune");
  if (options.position == "given")
    refuse_given(verb, {"--lidar-sigma-mm", "--blind-s"}, "with --position given there is no LIDAR");
  if (verb.count("--motor-loss") == 0)
    refuse_given(verb, {"--weak-rotor"}, "says which rotor lost thrust; --motor-loss says how much");
}

int tune_all(const FlyOptions& options) {
  check_tuned(options.controllers);
  check_none_lost(options);
  const NamedMap map = map_of(options);
  TuningSettings settings{.budget = options.budget, .workers = options.workers};
  std::vector<Tuned> tuned;
  for (const ControllerKind& kind : controller_kinds()) {
    const std::string name(kind.name);
    const auto wanted = std::find(options.controllers.begin(), options.controllers.end(), name);
    if (!kind.tuned || (!options.controllers.empty() && wanted == options.controllers.end())) continue;
    ProgressBar progress("tuning " + name);
    tuned.push_back(tune(name, map.map, settings, [&](int done) { progress.show(done, settings.budget); }));
    fmt::print("{}: cost {:.2f} mm, {:.2f} mm with the defaults\n", name, 1e3 * tuned.back().cost_m,
               1e3 * tuned.back().start_cost_m);
  }
  write_text(options.tune,
             format_gains(tuned, fmt::format("# Made by: {}\n# Map: {}. docs/flight.md says how.\n",
                                             arguments(), map.name)));
  return kWell;
}

/// Of several processes the first one speaks and writes; the others only fly.
FlyOptions quiet_options(FlyOptions options) {
  if (std::freopen("/dev/null", "w", stdout) == nullptr || std::freopen("/dev/null", "w", stderr) == nullptr)
    throw StorageError("/dev/null: cannot be opened", false);
  options.out.clear();
  options.json.clear();
  return options;
}

int run_fly(const FlyOptions& given, const CLI::App& verb) {
  const Processes processes;
  const FlyOptions options = processes.rank() > 0 ? quiet_options(given) : given;
  options.hidden.validate();
  if (options.hidden.motor_loss > 0 && verb.count("--weak-rotor") == 0)
    warn(fmt::format("--motor-loss without --weak-rotor: it is rotor {} that lost thrust",
                     options.hidden.weak_rotor));
  if (options.position != "lidar" && options.position != "lidar-thesis" && options.position != "given")
    throw InputError(fmt::format("--position {}: must be lidar, lidar-thesis or given", options.position));
  if (!options.blind_s.empty() && !(options.blind_s[0] >= 0 && options.blind_s[1] > options.blind_s[0]))
    throw InputError(fmt::format("--blind-s {:g},{:g}: must be two times, the second one later",
                                 options.blind_s[0], options.blind_s[1]));
  check_places(options);
  refuse_unused(options, verb);
  if (!options.tune.empty() && processes.count() > 1)
    throw InputError("--tune: each of mpirun's processes would do all of it; say it without mpirun");
  if (!options.tune.empty()) return tune_all(options);
  const NamedMap map = map_of(options);
  const GainTable gains =
      options.gains.empty() ? frozen_gains() : parse_gains(read_text(options.gains), options.gains);
  const bool programme = options.scenario == "all";
  const std::vector<PlaceAndPath> wanted = programme_of(options);
  check_all(options, wanted, gains);
  std::optional<FlightsFolder> out;
  if (!options.out.empty()) out.emplace(options.out);
  std::vector<FlownScenario> flown;
  fmt::print("SIMULATED flights; map: {}\n\n", map.name);
  for (const PlaceAndPath& one : wanted) {
    flown.push_back(fly_scenario(options, one, map, gains, processes, out ? &*out : nullptr));
    print_flown(flown.back());
  }
  if (programme) print_beside_thesis(flown);
  if (!options.json.empty()) write_text(options.json, flown_json(flown, map.name, options.seed, programme));
  if (out) {
    std::vector<std::string> shown;
    for (const FlownScenario& one : flown) shown.push_back(one.for_report);
    out->publish(flights_json(shown, arguments()));
  }
  return kWell;
}

}  // namespace

void add_fly(CLI::App& app, Work& work) {
  auto options = std::make_shared<FlyOptions>();
  CLI::App* verb =
      app.add_subcommand("fly", "Fly a map: controllers through the thesis's scenarios, simulated");
  verb->footer(
      "Everything flown is simulated; docs/flight.md.\n\n"
      "Examples: tunnelrig fly --map maps/disturbance_map.json --scenario circle --out flights\n"
      "          tunnelrig fly --scenario all\n"
      "          tunnelrig fly --tune gains.toml && tunnelrig fly --gains gains.toml");
  verb->add_option("--map", options->map, "disturbance_map.json; without it the published field, simulated");
  verb->add_option("--tunnel", options->tunnel, "1.5, 2.4, railway or a file (default 1.5)");
  verb->add_option("--scenario", options->scenario,
                   "hover, diagonal, ladder, circle, waypoints, training, identification, a file, or all "
                   "(the thesis's "
                   "programme)")
      ->capture_default_str();
  verb->add_option("--controllers", options->controllers, "Names with commas between; all of them otherwise")
      ->delimiter(',');
  verb->add_option("--runs", options->runs, "Flights of each")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  verb->add_option("--seed", options->seed, "Of all that is random")->capture_default_str();
  verb->add_option("--workers", options->workers,
                   "Threads; 0 is one per core. The results do not depend on it")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  verb->add_option(
          "--position", options->position,
          "lidar (scans, matcher, filter), lidar-thesis (the same with the thesis's filter) or given (exact)")
      ->capture_default_str();
  verb->add_option("--lidar-sigma-mm", options->lidar_sigma_mm, "Range noise of the LIDAR")
      ->check(CLI::Range(0.0, 500.0))
      ->capture_default_str();
  verb->add_option("--blind-s", options->blind_s, "FROM,TO: the LIDAR sees nothing meanwhile")
      ->delimiter(',')
      ->expected(2);
  verb->add_option("--gains", options->gains, "File of gains; the frozen ones otherwise");
  verb->add_option("--json", options->json, "Write the comparison to this file");
  verb->add_option("--out", options->out,
                   "Folder for logs, residual tables, pictures, and flights.json for the report");
  verb->add_option("--tune", options->tune, "Tune the controllers and write their gains to this file");
  verb->add_option("--budget", options->budget, "With --tune: evaluations per controller")
      ->check(CLI::Range(10, 100000))
      ->capture_default_str();
  verb->add_option("--payload-kg", options->hidden.payload_kg,
                   "Undeclared: mass that no controller knows of");
  verb->add_option("--map-scale", options->hidden.map_scale,
                   "Undeclared: the field is so many times the map");
  verb->add_option("--wind-m-s", options->hidden.wind_m_s, "Undeclared: steady wind along the tunnel");
  verb->add_option("--gust-m-s", options->hidden.gust_m_s,
                   "Undeclared: gusts along the tunnel, standard deviation");
  verb->add_option("--motor-loss", options->hidden.motor_loss,
                   "Undeclared: share of its thrust that a rotor lost");
  verb->add_option("--weak-rotor", options->hidden.weak_rotor,
                   "Which rotor that is, 1 to 4, numbered as the rig's")
      ->capture_default_str();
  verb->callback([options, verb, &work] { work = [options, verb] { return run_fly(*options, *verb); }; });
}

}  // namespace tunnelrig::cli
