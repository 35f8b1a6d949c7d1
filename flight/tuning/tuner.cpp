#include "flight/tuning/tuner.h"

#include "flight/tuning/cma_es.h"

#include <cmath>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

/// What every evaluation flies.
struct Course {
  Airframe frame;
  FlightSpace space;
  std::array<Scenario, 2> scenarios;

  Course()
      : space(tunnel_from("1.5"), frame),
        scenarios{scenario_from("hover", space, frame), scenario_from("training", space, frame)} {
    scenarios[0].trajectory = {};
    scenarios[0].trajectory.hold(space.middle_m(), 10);
    for (Scenario& scenario : scenarios) scenario.score_from_s = 1;
  }
};

/// √(mean over hover and training in the 1.5 m tunnel of rms² + (effort)² + contacts²), position given.
double cost_m(const Course& course, std::string_view controller, const GainTable& gains,
              const DisturbanceMap& map, const TuningSettings& settings) {
  double sum = 0;
  for (const Scenario& scenario : course.scenarios) {
    const FlightTask task{.space = &course.space,
                          .scenario = &scenario,
                          .map = &map,
                          .believed = course.frame,
                          .localisation = {},  // a tenth of the time; its error of 2 mm decides nothing here
                          .runs = settings.runs,
                          .workers = settings.workers,
                          .seed = settings.seed};
    for (const RunResult& run : fly_runs(task, controller, gains).runs) {
      const double effort_m = settings.effort_m_per_N * run.effort_N,
                   contact_m = settings.contact_m * run.contacts;
      sum += run.lost ? 100 : run.rms_m() * run.rms_m() + effort_m * effort_m + contact_m * contact_m;
    }
  }
  return std::sqrt(sum / (static_cast<double>(course.scenarios.size()) * settings.runs));
}

}  // namespace

double tuning_cost_m(std::string_view controller, const GainTable& gains, const DisturbanceMap& map,
                     const TuningSettings& settings) {
  return cost_m(Course(), controller, gains, map, settings);
}

Tuned tune(std::string_view controller, const DisturbanceMap& map, const TuningSettings& settings,
           const std::function<void(int)>& progress) {
  const Course course;
  AnyController example(controller, {}, {});
  const std::vector<NamedGain> list = example.gain_list();
  const auto n = static_cast<Eigen::Index>(list.size());
  const auto gains_at = [&](const Eigen::VectorXd& unit) {
    GainTable gains;
    for (Eigen::Index i = 0; i < n; ++i) {
      const NamedGain& gain = list[static_cast<std::size_t>(i)];
      gains[std::string(controller)][std::string(gain.name)] =
          gain.lowest * std::pow(gain.highest / gain.lowest, unit[i]);
    }
    return gains;
  };
  Eigen::VectorXd start(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const NamedGain& gain = list[static_cast<std::size_t>(i)];
    const double value = std::clamp(*gain.value, gain.lowest, gain.highest);
    start[i] = std::log(value / gain.lowest) / std::log(gain.highest / gain.lowest);
  }
  int evaluations = 0;
  const auto cost = [&](const Eigen::VectorXd& unit) {
    if (progress) progress(++evaluations);
    return cost_m(course, controller, gains_at(unit), map, settings);
  };
  const SearchResult found = minimise(cost, start, 0.15, settings.budget, settings.seed);
  const GainTable best = gains_at(found.best);
  Tuned tuned{.controller = std::string(controller),
              .cost_m = found.cost,
              .start_cost_m = cost_m(course, controller, gains_at(start), map, settings)};
  for (const auto& [name, value] : best.at(std::string(controller))) tuned.gains[name] = value;
  return tuned;
}

std::string format_gains(const std::vector<Tuned>& tuned, const std::string& comment) {
  std::string text = comment + "format = \"tunnelrig-gains/1\"\n";
  for (const Tuned& one : tuned) {
    text += fmt::format("\n[{}]  # cost {:.2f} mm, {:.2f} mm with the defaults\n", one.controller,
                        1e3 * one.cost_m, 1e3 * one.start_cost_m);
    for (const auto& [name, value] : one.gains) text += fmt::format("{} = {:.5g}\n", name, value);
  }
  return text;
}

}  // namespace tunnelrig
