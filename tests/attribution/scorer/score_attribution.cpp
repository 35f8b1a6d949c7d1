// score_attribution: the benchmark's table, from its results.
#include "attribution/scorer/metrics.h"
#include "datasets/error.h"

#include <algorithm>
#include <fstream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace {

using namespace tunnelrig;
using namespace tunnelrig::attribution;

std::string target_text(const Metric& metric) {
  const double unit = metric.is_share ? 100 : 1;
  const char* sign = metric.is_share ? " %" : "";
  const double low = metric.low_target * unit, high = metric.high_target * unit;
  if (metric.is_share && low == 0 && high == 100) return "";
  if (low == high) return fmt::format("= {:g}{}", low, sign);
  if (low == 0) return fmt::format("<= {:g}{}", high, sign);
  if (metric.is_share && high == 100) return fmt::format(">= {:g}{}", low, sign);
  return fmt::format("{:g} to {:g}{}", low, high, sign);
}

std::string value_text(const Metric& metric) {
  if (!metric.is_share) {
    return metric.count < 2 ? fmt::format("{:.3f}", metric.value)
                            : fmt::format("{:.3f} [{:.3f}, {:.3f}]", metric.value, metric.interval.low,
                                          metric.interval.high);
  }
  return fmt::format("{:5.1f} % [{:.1f}, {:.1f}]", 100 * metric.value, 100 * metric.interval.low,
                     100 * metric.interval.high);
}

void print_table(const std::vector<Metric>& metrics) {
  std::size_t width = 0;
  for (const Metric& metric : metrics) width = std::max(width, metric.name.size());
  std::string noise;
  for (const Metric& metric : metrics) {
    if (metric.noise != noise) {
      noise = metric.noise;
      fmt::print("\nnoise: {}\n{:<{}}  {:>7}  {:<14}  {:<22}\n", noise, "metric", width, "n", "target",
                 "value [95 %]");
    }
    const std::string target = target_text(metric);
    fmt::print("{:<{}}  {:>7}  {:<14}  {:<22}  {}\n", metric.name, width, metric.count, target,
               value_text(metric),
               target.empty() ? ""
               : metric.met() ? "met"
                              : "MISSED");
  }
}

nlohmann::ordered_json to_json(const Metric& metric) {
  nlohmann::ordered_json json = {{"metric", metric.name}, {"noise", metric.noise},
                                 {"count", metric.count}, {"target", {metric.low_target, metric.high_target}},
                                 {"value", metric.value}, {"met", metric.met()}};
  json["interval95"] = nullptr;
  if (metric.is_share || metric.count > 1) json["interval95"] = {metric.interval.low, metric.interval.high};
  if (metric.is_share) {
    json["successes"] = metric.successes;
    json["wilson95"] = {metric.narrow.low, metric.narrow.high};
  }
  return json;
}

std::vector<Outcome> read_results(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw InputError::in(path, "cannot be read");
  std::vector<Outcome> outcomes;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (!line.empty()) outcomes.push_back(parse_outcome(line, fmt::format("{}:{}", path, number)));
  }
  if (outcomes.empty()) throw InputError::in(path, "holds no result");
  return outcomes;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Scores what `explain` said about generated campaigns against their keys.");
  app.footer("Exit code 1: a target is missed.\n\nExample: score_attribution results.jsonl --by-level");
  std::string path;
  bool json = false;
  MetricOptions options;
  app.add_option("results", path, "JSON lines: key, explain, separated, seconds")->required();
  app.add_flag("--json", json, "Print as JSON");
  app.add_flag("--by-level", options.by_level, "Single effects also apart by level: run, session");
  app.add_flag("--by-effect", options.by_effect, "Single effects also apart by name");
  try {
    app.parse(argc, argv);
    const std::vector<Metric> metrics = score(read_results(path), options);
    if (json) {
      nlohmann::ordered_json all = nlohmann::ordered_json::array();
      for (const Metric& metric : metrics) all.push_back(to_json(metric));
      fmt::print("{}\n", all.dump(1));
    } else {
      print_table(metrics);
    }
    return std::all_of(metrics.begin(), metrics.end(), [](const Metric& metric) { return metric.met(); }) ? 0
                                                                                                          : 1;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "score_attribution: {}\n", error.what());
    return 2;
  }
}
