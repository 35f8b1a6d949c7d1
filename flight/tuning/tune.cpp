#include "flight/tuning/tune.h"

#include "flight/tuning/cma_es.h"

#include <cmath>
#include <iterator>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

double cost_of(const RunResult& run) {
  return 1e3 * (run.rms_m() + 0.2 * std::max(run.largest_m[0], run.largest_m[1])) + 2 * run.effort_N +
         100 * run.contacts + (run.lost ? 1e4 : 0);
}

}  // namespace

TunedController tune(std::string_view name, const TuningSettings& settings) {
  const Airframe frame;
  const FlightSpace wide(tunnel_from("2.4"), frame), narrow(tunnel_from("1.5"), frame);
  Programme hover{.scenario = scenario_from("hover", wide, frame),
                  .space = &wide,
                  .map = published_disturbance_map(),
                  .believed = frame,
                  .localisation = settings.localisation,
                  .controllers = {std::string(name)},
                  .runs = settings.runs,
                  .seed = settings.seed,
                  .threads = settings.threads};
  Programme figure = hover;
  figure.scenario = scenario_from("figure", narrow, frame);
  figure.space = &narrow;

  const std::vector<NamedGain> gains = AnyController(name, {}, {}).gain_list();
  // The list points into a controller that is gone: only names and limits are used, and the defaults are read from a living one.
  AnyController defaults(name, {}, {});
  std::vector<double> start, low, high;
  for (const NamedGain& gain : defaults.gain_list()) {
    start.push_back(std::log(std::max(*gain.value, gain.lowest)));
    low.push_back(std::log(gain.lowest));
    high.push_back(std::log(gain.highest));
  }
  const auto table = [&](const std::vector<double>& logarithms) {
    std::map<std::string, double> values;
    // Six digits, as the file has them: what was judged is what will fly.
    for (std::size_t i = 0; i < gains.size(); ++i)
      values[std::string(gains[i].name)] =
          std::clamp(std::stod(fmt::format("{:.5g}", std::exp(logarithms[i]))), gains[i].lowest, gains[i].highest);
    return values;
  };
  const auto cost = [&](const std::vector<double>& logarithms) {
    double sum = 0;
    for (Programme* programme : {&hover, &figure}) {
      programme->gains = {{std::string(name), table(logarithms)}};
      for (const RunResult& run : fly_programme(*programme)[0].runs) sum += cost_of(run);
    }
    return sum / (2 * settings.runs);
  };
  const CmaResult result =
      minimise(cost, start, low, high, {.evaluations = settings.evaluations, .seed = settings.seed});
  return {std::string(name), table(result.best), result.cost_at_start, result.cost};
}

std::string format_gains(const std::vector<TunedController>& tuned, const TuningSettings& settings,
                         const std::string& command) {
  std::string text = fmt::format(
      "# Gains of the controllers, frozen before they are compared. Made by\n"
      "#   {}\n"
      "# {} evaluations each of the same optimiser on the same cost and flights (flight/tuning/tune.h); costs in mm.\n"
      "format = \"tunnelrig-gains/1\"\n",
      command, settings.evaluations);
  for (const TunedController& controller : tuned) {
    fmt::format_to(std::back_inserter(text), "\n[{}]  # cost {:.1f}, with the defaults {:.1f}\n", controller.name,
                   controller.cost, controller.cost_before);
    for (const auto& [name, value] : controller.gains)
      fmt::format_to(std::back_inserter(text), "{} = {:.5g}\n", name, value);
  }
  return text;
}

}  // namespace tunnelrig
