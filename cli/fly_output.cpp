#include "cli/fly_output.h"

#include "cli/console.h"
#include "cli/fly_pictures.h"
#include "datasets/csv.h"
#include "datasets/output_place.h"

#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

constexpr double kMm = 1e3;

std::string contacts_text(const Comparison& c) {
  const RunResult* earliest = nullptr;
  for (const RunResult& run : c.runs)
    if (!run.touched.empty() && (earliest == nullptr || run.touched[0].time_s < earliest->touched[0].time_s))
      earliest = &run;
  if (earliest == nullptr) return "0";
  const ContactEvent& first = earliest->touched[0];
  return fmt::format("{} in {} runs, first at {:.2f} s, ({:.0f}, {:.0f}) mm", c.contacts, c.runs_with_contact,
                     first.time_s, kMm * first.y_m, kMm * first.z_m);
}

double rounded(double value) { return std::round(value * 1e4) / 1e4; }

/// For the JSON, which has no infinity.
nlohmann::ordered_json error_mm(double error_m) {
  return std::isfinite(error_m) ? nlohmann::ordered_json(rounded(kMm * error_m)) : nlohmann::ordered_json();
}

/// For a table; infinite is the error of a controller that lost a flight.
std::string error_text(double error_m, int decimals) {
  return std::isfinite(error_m) ? fmt::format("{:.{}f}", kMm * error_m, decimals) : "lost";
}

std::string interval_text(const Comparison& c) {
  if (c.lost > 0) return "lost";
  return c.has_interval() ? fmt::format("{:.1f} to {:.1f}", kMm * c.ci95_low_m, kMm * c.ci95_high_m) : "-";
}

/// What it errs more than the first controller, run by run.
std::string difference_text(const Comparison& c, const Comparison& first) {
  const auto difference = paired_difference(c, first);
  if (&c == &first || !difference) return "-";
  return fmt::format("{:+.2f} to {:+.2f}", kMm * difference->low_m, kMm * difference->high_m);
}

nlohmann::ordered_json controller_json(const Comparison& c) {
  nlohmann::ordered_json json{{"name", c.controller},
                              {"runs", c.runs.size()},
                              {"lost", c.lost},
                              {"rms_y_mm", error_mm(c.rms_y_m)},
                              {"rms_z_mm", error_mm(c.rms_z_m)},
                              {"max_y_mm", error_mm(c.largest_y_m)},
                              {"max_z_mm", error_mm(c.largest_z_m)},
                              {"ci95_rms_mm", nullptr},
                              {"contacts", c.contacts},
                              {"first_contact_s", nullptr},
                              {"estimator_rms_mm", rounded(kMm * c.estimator_rms_m)},
                              {"thrust_saturated_s", rounded(c.saturated_s)}};
  if (c.has_interval()) json["ci95_rms_mm"] = {error_mm(c.ci95_low_m), error_mm(c.ci95_high_m)};
  if (c.first_contact_s) json["first_contact_s"] = rounded(*c.first_contact_s);
  return json;
}

nlohmann::ordered_json scenario_json(const FlownScenario& flown, const std::string& map, std::uint64_t seed) {
  nlohmann::ordered_json json{{"format", "tunnelrig-fly/1"},
                              {"tunnel", flown.tunnel},
                              {"scenario", flown.scenario},
                              {"map", map},
                              {"seed", seed},
                              {"extrapolated", nullptr},
                              {"controllers", nlohmann::ordered_json::array()}};
  if (!flown.extrapolated.empty()) json["extrapolated"] = flown.extrapolated;
  for (const Comparison& c : flown.controllers) json["controllers"].push_back(controller_json(c));
  return json;
}

struct Printed {
  const char *tunnel, *scenario, *controller, *result;
};

constexpr const char* kNotFlown = "not flown: PID with feed-forward";

/// 6.3 of the thesis, by the controller of ours that is its.
constexpr Printed kPrinted[] = {
    {"2.4", "hover", "ibs", "within ±60 mm"},
    {"2.4", "hover", "pid-single", "within ±60 mm"},
    {"2.4", "hover", "pid-ff", kNotFlown},
    {"2.4", "diagonal", "ibs", "z ±50 mm; y 75 mm at first, then ±50 mm"},
    {"2.4", "diagonal", "pid-ff", kNotFlown},
    {"2.4", "ladder", "ibs", "y ±60 mm; z slightly better than PID"},
    {"2.4", "ladder", "pid-single", "y ±60 mm"},
    {"2.4", "ladder", "pid-ff", kNotFlown},
    {"2.4", "circle", "ibs", "±50 mm on both axes"},
    {"2.4", "circle", "pid-single", "z about ±200 mm, oval path"},
    {"2.4", "circle", "pid-stock", "PID: z about ±200 mm, oval path"},
    {"2.4", "circle", "pid-ff", kNotFlown},
    {"1.5", "circle", "ibs", "y ±50 mm; a z offset that decays"},
    {"1.5", "circle", "pid-single", "touches the wall at 1 s and 5.1 s near (370, 460) mm"},
    {"1.5", "circle", "pid-ff-stock", "PID: touches the wall at 1 s and 5.1 s near (370, 460) mm"},
    {"1.5", "circle", "pid-ff", kNotFlown},
    {"railway", "waypoints", "ibs", "flown; no error printed"},
};

/// A column of the rows that are kept, to a tenth of a millimetre.
template <typename Value>
nlohmann::ordered_json column(const FlightLog& log, Value value) {
  constexpr std::size_t kEvery = 5;  // of 50 rows a second
  nlohmann::ordered_json values = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < log.rows.size(); i += kEvery) values.push_back(rounded(value(log.rows[i])));
  return values;
}

std::string comparison_csv(const FlownScenario& flown) {
  std::string text =
      "controller,runs,rms_y_mm,rms_z_mm,max_y_mm,max_z_mm,p95_y_mm,p95_z_mm,ci95_low_mm,ci95_high_mm,"
      "contacts,"
      "runs_with_contact,lost,effort_N,thrust_saturated_s,outside_map_s,estimator_rms_mm,nees,rejected_"
      "share\n";
  for (const Comparison& c : flown.controllers) {
    fmt::format_to(
        std::back_inserter(text),
        "{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{},{:.5f},{:.4f},{:.4f},{:.4f},"
        "{:.4f},{:.5f}\n",
        c.controller, c.runs.size(), kMm * c.rms_y_m, kMm * c.rms_z_m, kMm * c.largest_y_m,
        kMm * c.largest_z_m, kMm * c.p95_y_m, kMm * c.p95_z_m, kMm * c.ci95_low_m, kMm * c.ci95_high_m,
        c.contacts, c.runs_with_contact, c.lost, c.effort_N, c.saturated_s, c.clamped_s,
        kMm * c.estimator_rms_m, c.nees, c.rejected_share);
  }
  return text;
}

/// What controllers are compared by, run by run: `all` of them fly the same ones.
void add_runs(nlohmann::ordered_json& controller, const Comparison& c, const std::vector<Comparison>& all) {
  auto errors = nlohmann::ordered_json::array(), contacts = nlohmann::ordered_json::array();
  for (const RunResult& run : c.runs) {
    errors.push_back(error_mm(run.rms_m()));
    contacts.push_back(run.contacts);
  }
  controller["rms_of_runs_mm"] = std::move(errors);
  controller["contacts_of_runs"] = std::move(contacts);
  auto& more = controller["more_than_mm"] = nlohmann::ordered_json::object();
  for (const Comparison& other : all) {
    if (const auto difference = paired_difference(c, other); difference && &other != &c)
      more[other.controller] = {error_mm(difference->low_m), error_mm(difference->high_m)};
  }
}

std::string position_of(const FlightTask& task) {
  if (!task.localisation) return "given";
  return task.localisation->filter == FlightFilter::thesis ? "lidar-thesis" : "lidar";
}

}  // namespace

std::string scenario_folder(const std::string& tunnel, const std::string& scenario) {
  return tunnel + "-" + scenario;
}

std::string flight_for_report(const FlownScenario& flown, const FlightTask& task, const std::string& map) {
  nlohmann::ordered_json json = scenario_json(flown, map, task.seed);
  json["position"] = position_of(task);
  json["walls"] = nlohmann::ordered_json::array();
  for (const auto& edge : task.space->walls.edges())
    json["walls"].push_back({rounded(edge.from[0]), rounded(edge.from[1])});
  for (std::size_t i = 0; i < flown.logs.size(); ++i) {
    const FlightLog& log = flown.logs[i];
    if (i == 0) {
      json["reference"] = {{"time_s", column(log, [](const LogRow& r) { return r.time_s; })},
                           {"y_m", column(log, [](const LogRow& r) { return r.reference_m[0]; })},
                           {"z_m", column(log, [](const LogRow& r) { return r.reference_m[1]; })}};
    }
    add_runs(json["controllers"][i], flown.controllers[i], flown.controllers);
    json["controllers"][i]["path"] = {{"y_m", column(log, [](const LogRow& r) { return r.position_m[0]; })},
                                      {"z_m", column(log, [](const LogRow& r) { return r.position_m[1]; })}};
  }
  return json.dump();
}

std::string flights_json(const std::vector<std::string>& flights, const std::string& command) {
  nlohmann::ordered_json json{{"format", kFlightsFormat}, {"command", command}, {"flights", {}}};
  json["flights"] = nlohmann::ordered_json::array();
  for (const std::string& one : flights) json["flights"].push_back(nlohmann::ordered_json::parse(one));
  return json.dump() + "\n";
}

void print_flown(const FlownScenario& flown) {
  fmt::print("{} in the {} tunnel, {} runs{}\n", flown.scenario, flown.tunnel,
             flown.controllers.empty() ? 0 : flown.controllers[0].runs.size(),
             flown.extrapolated.empty() ? "" : ", extrapolated");
  const std::string more =
      flown.controllers.empty() ? "" : fmt::format("more than {} [mm]", flown.controllers[0].controller);
  Table table({"controller", "rms y [mm]", "rms z [mm]", "max y [mm]", "max z [mm]", "p95 y [mm]",
               "p95 z [mm]", "mean rms, 95 % [mm]", more, "effort [N]", "saturated [s]", "estimator [mm]",
               "NEES/4", "contacts"});
  for (const Comparison& c : flown.controllers) {
    const auto mm = [](double m) { return error_text(m, 1); };
    table.add({c.controller, mm(c.rms_y_m), mm(c.rms_z_m), mm(c.largest_y_m), mm(c.largest_z_m),
               mm(c.p95_y_m), mm(c.p95_z_m), interval_text(c), difference_text(c, flown.controllers[0]),
               fmt::format("{:.2f}", c.effort_N), fmt::format("{:.2f}", c.saturated_s),
               fmt::format("{:.1f}", kMm * c.estimator_rms_m),
               c.nees > 0 ? fmt::format("{:.2f}", c.nees / 4) : "-",
               contacts_text(c) +
                   (c.lost > 0 ? fmt::format("; {} of {} flights lost", c.lost, c.runs.size()) : "")});
  }
  table.print();
  double outside_s = 0;
  for (const Comparison& c : flown.controllers) outside_s = std::max(outside_s, c.clamped_s);
  if (outside_s > 0)
    fmt::print("Up to {:.3g} s of a run were outside the map, where its border's values hold.\n", outside_s);
  fmt::print("\n");
}

std::string flown_json(const std::vector<FlownScenario>& flown, const std::string& map, std::uint64_t seed,
                       bool programme) {
  if (!programme) return scenario_json(flown[0], map, seed).dump(1) + "\n";
  nlohmann::ordered_json json{{"format", "tunnelrig-fly-programme/1"},
                              {"scenarios", nlohmann::ordered_json::array()}};
  for (const FlownScenario& one : flown) json["scenarios"].push_back(scenario_json(one, map, seed));
  return json.dump(1) + "\n";
}

void print_beside_thesis(const std::vector<FlownScenario>& flown) {
  Table table({"tunnel", "scenario", "controller", "thesis (flown)", "here (simulated): max y, z [mm]",
               "rms y, z [mm]", "contacts"});
  for (const Printed& printed : kPrinted) {
    for (const FlownScenario& one : flown) {
      if (one.tunnel != printed.tunnel || one.scenario != printed.scenario) continue;
      for (const Comparison& c : one.controllers) {
        if (c.controller != printed.controller) continue;
        table.add({one.tunnel, one.scenario, c.controller, printed.result,
                   error_text(c.largest_y_m, 0) + ", " + error_text(c.largest_z_m, 0),
                   error_text(c.rms_y_m, 0) + ", " + error_text(c.rms_z_m, 0), contacts_text(c)});
      }
    }
  }
  table.print();
  fmt::print(
      "Circles are judged after the first turn, contacts always.\n"
      "Smaller errors than flown: gains are tuned to an optimiser's end on this very simulation, whose "
      "unmodelled "
      "parts are those of docs/flight.md and no others.\n"
      "The thesis's PID feeds no acceleration of the reference forward, its backstepping does; pid-ff is the "
      "PID that does as well.\n");
}

std::vector<std::filesystem::path> write_flown(const std::filesystem::path& folder,
                                               const FlownScenario& flown, const FlightTask& task,
                                               std::string& warning) {
  const FoldersForOutput made(folder);
  make_folder(folder);
  std::vector<std::filesystem::path> files;
  const auto write = [&](const std::string& name, const std::string& text) {
    files.push_back(folder / name);
    write_text(files.back(), text);
  };
  write("comparison.csv", comparison_csv(flown));
  for (std::size_t i = 0; i < flown.logs.size(); ++i) {
    const std::string& name = flown.controllers[i].controller;
    write(name + ".csv", format_log(flown.logs[i]));
    write(name + "-residual.csv", format_residuals(flown.identification[i], task.believed));
  }
  for (const char* response : kResiduals) {
    write(fmt::format("residual-{}.toml", response), residual_schema(response));
    write(fmt::format("effects-{}.toml", response), residual_effects(response, task.believed));
  }
  if (!flown.logs.empty()) {
    for (auto& file : draw_flown(folder, flown, task, warning)) files.push_back(std::move(file));
  }
  return files;
}

}  // namespace tunnelrig::cli
