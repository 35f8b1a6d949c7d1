// `./rig bench flight`: speed of the loops and of a controller's step, and the flights' goals. One core.
#include "flight/simulation/flight_loop.h"
#include "flight/simulation/monte_carlo.h"

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <string_view>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

/// CPU time of this process, so that other work on the machine counts as little as it can; one worker.
double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Place {
  Airframe frame;
  FlightSpace space;
  DisturbanceMap map = published_disturbance_map();
  Scenario circle;

  explicit Place(const std::string& tunnel)
      : space(tunnel_from(tunnel), frame), circle(scenario_from("circle", space, frame)) {}

  FlightTask task(int runs, bool localised) const {
    FlightTask task{
        .space = &space, .scenario = &circle, .map = &map, .believed = frame, .runs = runs, .workers = 1};
    if (!localised) task.localisation.reset();
    return task;
  }
};

/// Best of five, as other work on the machine only ever slows down.
void loop_speed(const Place& place, const char* controller, bool localised, int runs, double goal) {
  double best = 0;
  for (int i = 0; i < 5; ++i) {
    const double start_s = cpu_s();
    fly_runs(place.task(runs, localised), controller, frozen_gains());
    best = std::max(best, runs * place.circle.trajectory.duration_s() / (cpu_s() - start_s));
  }
  fmt::print(
      "{:<58} {:>8.0f} x    goal >= {:>5.0f}   {:>5.2f} of it   {}\n",
      fmt::format("closed loop over real time, {}, {}", localised ? "scans" : "position given", controller),
      best, goal, best / goal, best >= goal ? "met" : "MISSED");
}

void line(const std::string& what, double value, const char* unit, double goal) {
  const std::string share = goal > 0 ? fmt::format("{:>5.2f} of it", value / goal) : "           ";
  fmt::print("{:<58} {:>8.2f} {:<4} goal <= {:>5.1f}   {}   {}\n", what, value, unit, goal, share,
             value <= goal ? "met" : "MISSED");
}

void step_speed(const Place& place, std::string_view name) {
  const DisturbanceField field(place.map);
  FlightSetup setup;
  setup.map = &field;
  setup.scale = place.space.scale(place.frame);
  AnyController controller(name, frozen_gains(), controller_context(setup));
  ControlInput in;
  in.reference = place.circle.trajectory.at(0.7);
  in.cos_tilt = 0.999;
  double best = 1e9, kept = 0;
  constexpr int kSteps = 1'000'000;
  for (int round = 0; round < 5; ++round) {
    const double start_s = cpu_s();
    for (int i = 0; i < kSteps; ++i) {
      in.position_m = {0.3 + 1e-8 * i, 0.65};
      kept += controller.step(in).roll_rad;
    }
    best = std::min(best, 1e9 * (cpu_s() - start_s) / kSteps);
  }
  line(fmt::format("controller step, {}", name), std::isfinite(kept) ? best : INFINITY, "ns", 30);
}

void circle_goals(const std::string& tunnel, const char* controller, int runs) {
  const Place place(tunnel);
  FlightTask task = place.task(runs, true);
  task.workers = 0;
  const Comparison c = fly_runs(task, controller, frozen_gains());
  const std::string what = fmt::format("circle, {} tunnel, {}, {} runs: ", tunnel, controller, runs);
  line(what + "rms y", 1e3 * c.rms_y_m, "mm", 20);
  line(what + "rms z", 1e3 * c.rms_z_m, "mm", 20);
  line(what + "max y", 1e3 * c.largest_y_m, "mm", 50);
  line(what + "max z", 1e3 * c.largest_z_m, "mm", 50);
  line(what + "contacts", c.contacts, "", 0);
  line(what + "lost", c.lost, "", 0);
}

/// Mean over runs of the normalised error squared, per degree of freedom, and the half width of its 95 %
/// interval.
std::string consistency(const Comparison& c) {
  const auto n = static_cast<double>(c.runs.size());
  double squares = 0;
  for (const RunResult& run : c.runs) squares += (run.nees - c.nees) * (run.nees - c.nees);
  return fmt::format("{:.2f} ± {:.2f}", c.nees / 4, 1.96 * std::sqrt(squares / (n - 1) / n) / 4);
}

void estimator_goal(int runs) {
  const Place place("1.5");
  for (const bool exact : {false, true}) {
    FlightTask task = place.task(runs, true);
    task.workers = 0;
    task.localisation->lidar.range_sigma_m = 0.040;
    if (exact) task.spread = Spread::none();
    const Comparison c = fly_runs(task, "ibs-map", frozen_gains());
    const char* which = exact ? "sensors without bias" : "sensors with bias";
    line(fmt::format("estimator, 1.5 m, 40 mm range noise, {}: rms", which), 1e3 * c.estimator_rms_m, "mm",
         5);
    fmt::print("  normalised error squared over its four degrees of freedom: {} (1: consistent)\n",
               consistency(c));
  }
}

/// The filter that flies beside the thesis's, over the programme's places.
void filters(int runs) {
  fmt::print("\n{:<34} {:>20} {:>14}   {:>20} {:>14}\n", "filter in flight, 40 mm range noise",
             "inertial: rms", "NEES of 1", "thesis's: rms", "NEES of 1");
  for (const char* tunnel : {"1.5", "2.4", "railway"}) {
    const Place place(tunnel);
    for (const char* name : {"hover", "diagonal", "circle"}) {
      const Scenario scenario = scenario_from(name, place.space, place.frame);
      fmt::print("{:<34}", fmt::format("{}, {}", tunnel, name));
      for (const FlightFilter filter : {FlightFilter::inertial, FlightFilter::thesis}) {
        FlightTask task = place.task(runs, true);
        task.scenario = &scenario;
        task.workers = 0;
        task.localisation->filter = filter;
        task.localisation->lidar.range_sigma_m = 0.040;
        const Comparison c = fly_runs(task, "ibs-map", frozen_gains());
        fmt::print("  {:>16.2f} mm {:>15}", 1e3 * c.estimator_rms_m, consistency(c));
      }
      fmt::print("\n");
    }
  }
  fmt::print("\n");
}

/// The error that the walls make: the flight with them less the same flight without, position given, same
/// noise. The map is exact: the field that is flown.
void gain_from_map(const std::string& tunnel) {
  const Place place(tunnel);
  const auto induced_m = [&](const char* controller) {
    FlightTask with = place.task(1, false), without = with;
    without.map = nullptr;
    with.spread = without.spread = Spread::none();
    const FlightLog a = fly_logged(with, controller, frozen_gains()),
                    b = fly_logged(without, controller, frozen_gains());
    double sum = 0;
    for (std::size_t i = 0; i < a.rows.size(); ++i) {
      sum += std::pow(a.rows[i].position_m[0] - b.rows[i].position_m[0], 2) +
             std::pow(a.rows[i].position_m[1] - b.rows[i].position_m[1], 2);
    }
    return std::sqrt(sum / static_cast<double>(a.rows.size()));
  };
  const double off = induced_m("ibs-map-off"), on = induced_m("ibs-map");
  fmt::print(
      "error that the walls make, {} tunnel: {:.2f} mm without the map, {:.2f} mm with an exact one fed "
      "forward\n",
      tunnel, 1e3 * off, 1e3 * on);
  line("  share that is left", on / off, "", 0.5);
}

}  // namespace
}  // namespace tunnelrig

int main(int argc, char** argv) {
  using namespace tunnelrig;
  const int runs = argc > 1 ? std::atoi(argv[1]) : 1000;
  const Place place("1.5");
  loop_speed(place, "ibs", false, 20, 5000);
  loop_speed(place, "ibs-map", false, 20, 5000);
  loop_speed(place, "ibs-map", true, 4, 500);
  for (const ControllerKind& kind : controller_kinds()) {
    if (kind.tuned) step_speed(place, kind.name);
  }
  for (const char* tunnel : {"1.5", "2.4"}) circle_goals(tunnel, "ibs-map", runs);
  estimator_goal(20);
  filters(20);
  for (const char* tunnel : {"1.5", "2.4"}) gain_from_map(tunnel);
}
