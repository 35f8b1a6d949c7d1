#include "attribution/scorer/metrics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include <fmt/format.h>

namespace tunnelrig::attribution {
namespace {

/// Nothing: the campaign has no say in this metric.
using Judgement = std::function<std::optional<bool>(const Outcome&)>;
using Value = std::function<std::vector<double>(const Outcome&)>;

bool near(double a, double b) { return std::abs(a - b) < 1e-9; }

bool main_design(const Outcome& o) { return o.key.blocks >= 16 && o.key.order == "randomised"; }

bool in_some_set(const Explanation& found, const std::string& effect) {
  return std::any_of(found.adopted.begin(), found.adopted.end(),
                     [&](const FoundEffect& one) { return one.set_contains(effect); });
}

bool truths_in_sets(const Outcome& o) {
  return o.explanation &&
         std::all_of(o.key.effects.begin(), o.key.effects.end(),
                     [&](const TrueEffect& truth) { return in_some_set(*o.explanation, truth.name); });
}

/// The names that are given are the true ones, no more and no fewer.
bool exactly_the_truth(const Outcome& o, const std::optional<Explanation>& found) {
  if (!found || found->adopted.size() != o.key.effects.size()) return false;
  std::multiset<std::string> names, truths;
  for (const FoundEffect& one : found->adopted) names.insert(one.name);
  for (const TrueEffect& one : o.key.effects) truths.insert(one.name);
  return names == truths;
}

bool gave_a_name(const Outcome& o) { return !o.explanation || !o.explanation->adopted.empty(); }

bool unknown_with_right_covariate(const Outcome& o) {
  if (!o.explanation || !o.explanation->adopted.empty()) return false;
  const auto& said = o.explanation->unknown_covariates;
  const auto& truths = o.key.effects.front().covariates;
  return std::any_of(truths.begin(), truths.end(), [&](const std::string& covariate) {
    return std::find(said.begin(), said.end(), covariate) != said.end();
  });
}

/// One set holds the truth and what cannot be told from it.
bool flagged(const Outcome& o) {
  if (!o.explanation) return false;
  return std::any_of(o.explanation->adopted.begin(), o.explanation->adopted.end(),
                     [&](const FoundEffect& one) {
                       return std::all_of(o.key.acceptable.begin(), o.key.acceptable.end(),
                                          [&](const std::string& name) { return one.set_contains(name); });
                     });
}

/// With the proposed runs made, the truth is named and its partner is out of the set.
bool resolved(const Outcome& o) {
  if (!o.separated) return false;
  const std::string& truth = o.key.effects.front().name;
  return std::any_of(o.separated->adopted.begin(), o.separated->adopted.end(),
                     [&](const FoundEffect& one) { return one.name == truth; }) &&
         std::none_of(o.key.acceptable.begin(), o.key.acceptable.end(), [&](const std::string& name) {
           return name != truth && in_some_set(*o.separated, name);
         });
}

/// The true value of a found parameter: of its name and unit, else the only one of its unit.
std::optional<double> true_value(const TrueEffect& truth, const FoundParameter& found) {
  std::vector<double> of_unit;
  for (const TrueParameter& one : truth.parameters) {
    if (one.unit != found.unit) continue;
    if (one.name == found.name) return one.value;
    of_unit.push_back(one.value);
  }
  if (of_unit.size() == 1) return of_unit.front();
  return {};
}

/// 1 for every interval that holds the true value, 0 for every one that does not.
std::vector<double> parameter_coverage(const Outcome& o) {
  std::vector<double> covered;
  if (!exactly_the_truth(o, o.explanation)) return covered;
  for (const TrueEffect& truth : o.key.effects) {
    for (const FoundEffect& one : o.explanation->adopted) {
      if (one.name != truth.name) continue;
      for (const FoundParameter& parameter : one.parameters) {
        const auto value = true_value(truth, parameter);
        // known physics taken at its value has no interval
        if (!value || !(parameter.high > parameter.low)) continue;
        covered.push_back(*value >= parameter.low && *value <= parameter.high ? 1 : 0);
      }
    }
  }
  return covered;
}

class Table {
 public:
  Table(std::span<const Outcome> outcomes, std::string noise) : noise_(std::move(noise)) {
    for (const Outcome& outcome : outcomes) {
      if (outcome.key.noise == noise_) outcomes_.push_back(&outcome);
    }
  }

  void share(const std::string& name, double low_target, double high_target, const Judgement& judge) {
    Metric metric = begin(name, low_target, high_target);
    for (const Outcome* outcome : outcomes_) {
      if (const auto verdict = judge(*outcome)) {
        metric.successes += *verdict ? 1 : 0;
        ++metric.count;
      }
    }
    finish_share(metric);
  }

  /// A share of things of which a campaign has several or none.
  void share_of(const std::string& name, double low_target, double high_target, const Value& values) {
    Metric metric = begin(name, low_target, high_target);
    for (const Outcome* outcome : outcomes_) {
      for (const double value : values(*outcome)) {
        metric.successes += value > 0.5 ? 1 : 0;
        ++metric.count;
      }
    }
    finish_share(metric);
  }

  void mean(const std::string& name, double low_target, double high_target, const Value& values) {
    Metric metric = begin(name, low_target, high_target);
    metric.is_share = false;
    std::vector<double> all;
    for (const Outcome* outcome : outcomes_) {
      for (const double value : values(*outcome)) {
        if (std::isfinite(value)) all.push_back(value);
      }
    }
    if (all.empty()) return;
    const MeanInterval result = mean_interval(all);
    metric.count = static_cast<int>(all.size());
    metric.value = result.mean;
    metric.interval = result.interval;
    metrics.push_back(metric);
  }

  std::vector<Metric> metrics;

 private:
  Metric begin(const std::string& name, double low_target, double high_target) const {
    return {.name = name, .noise = noise_, .low_target = low_target, .high_target = high_target};
  }

  void finish_share(Metric& metric) {
    if (metric.count == 0) return;
    metric.value = static_cast<double>(metric.successes) / metric.count;
    metric.interval = clopper_pearson(metric.successes, metric.count);
    metric.narrow = wilson(metric.successes, metric.count);
    metrics.push_back(metric);
  }

  std::string noise_;
  std::vector<const Outcome*> outcomes_;
};

/// `judge` of the main design's campaigns of a track; of a size, where one is given.
Judgement on(const std::string& track, std::optional<double> size,
             const std::function<bool(const Outcome&)>& judge) {
  return [=](const Outcome& o) -> std::optional<bool> {
    if (!main_design(o) || o.key.track != track || (size && !near(o.key.size, *size))) return {};
    return judge(o);
  };
}

Value ratio_on(const std::string& track, const std::function<double(const Explanation&, const Key&)>& ratio) {
  return [=](const Outcome& o) -> std::vector<double> {
    if (!main_design(o) || o.key.track != track || !o.explanation) return {};
    return {ratio(*o.explanation, o.key)};
  };
}

void add_names(Table& table) {
  table.share("no effect: a name given", 0, 0.05, on("none", {}, gave_a_name));
  for (const double size : {1.0, 2.0}) {
    table.share(fmt::format("outside, {:g} sigma: a wrong name", size), 0, 0.05,
                on("outside", size, gave_a_name));
    table.share(fmt::format("outside, {:g} sigma: unknown, right covariate", size), 0.90, 1,
                on("outside", size, unknown_with_right_covariate));
  }
  table.share("one effect, 1 sigma: truth in the set", 0.98, 1, on("one", 1.0, truths_in_sets));
  table.share("one effect, 0.5 sigma: truth in the set", 0.90, 1, on("one", 0.5, truths_in_sets));
  table.share("one effect, 1 sigma: named, nothing else", 0.93, 1,
              on("one", 1.0, [](const Outcome& o) { return exactly_the_truth(o, o.explanation); }));
  table.share("two effects, 1 sigma: both in sets", 0.95, 1, on("two", 1.0, truths_in_sets));
  table.share("two effects, 1 sigma: exactly those", 0.85, 1,
              on("two", 1.0, [](const Outcome& o) { return exactly_the_truth(o, o.explanation); }));
  table.share("confounded pair: flagged", 0.95, 1, on("confounded", 1.0, flagged));
  table.share("confounded pair: resolved by the run", 0.90, 1, [](const Outcome& o) -> std::optional<bool> {
    if (!on("confounded", 1.0, flagged)(o).value_or(false)) return {};
    return resolved(o);
  });
}

void add_errors(Table& table) {
  const auto over_floor = [](const Explanation& e, const Key& /*key*/) {
    return e.held_out_N / e.noise_floor_N;
  };
  const auto over_truth = [](const Explanation& e, const Key& key) { return e.noise_floor_N / key.floor_N; };
  table.mean("one effect: held-out error after / floor", 0, 1.05, ratio_on("one", over_floor));
  table.mean("two effects: held-out error after / floor", 0, 1.10, ratio_on("two", over_floor));
  for (const char* track : {"none", "one", "two"}) {
    table.mean(fmt::format("{}: floor / true floor", track), 0.95, 1.05, ratio_on(track, over_truth));
  }
  table.share_of("95 % intervals of parameters cover", 0.93, 0.97, [](const Outcome& o) {
    return main_design(o) ? parameter_coverage(o) : std::vector<double>();
  });
  table.share("95 % intervals of the error cover", 0.93, 0.97, [](const Outcome& o) -> std::optional<bool> {
    if (!main_design(o) || !o.explanation || !exactly_the_truth(o, o.explanation)) return {};
    return o.key.floor_N >= o.explanation->held_out_low_N && o.key.floor_N <= o.explanation->held_out_high_N;
  });
}

void add_rules(Table& table) {
  table.share("five blocks or fewer: insufficient", 1, 1, [](const Outcome& o) -> std::optional<bool> {
    if (o.key.blocks > 5) return {};
    return o.explanation && o.explanation->verdict == "insufficient";
  });
  table.share("not recorded: a name that is not the truth", 0, 1,
              on("not_recorded", {},
                 [](const Outcome& o) { return gave_a_name(o) && !exactly_the_truth(o, o.explanation); }));
  table.share("explain failed", 0, 0, [](const Outcome& o) -> std::optional<bool> { return !o.explanation; });
  table.share("contract broken", 0, 0, [](const Outcome& o) -> std::optional<bool> {
    if (!o.explanation) return {};
    return !o.explanation->broken_rules.empty();
  });
}

void add_details(Table& table, std::span<const Outcome> outcomes, const MetricOptions& options) {
  std::set<std::pair<double, std::string>> groups;
  const auto group_of = [&](const Outcome& o) {
    return options.by_effect ? o.key.effects.front().name : o.key.effects.front().level;
  };
  for (const Outcome& o : outcomes) {
    if (o.key.track == "one" && main_design(o)) groups.insert({o.key.size, group_of(o)});
  }
  for (const auto& size_and_group : groups) {
    const double size = size_and_group.first;
    const std::string& group = size_and_group.second;
    const auto in_group = [&](const auto& judge) {
      return [&, judge](const Outcome& o) -> std::optional<bool> {
        if (!on("one", size, judge)(o) || group_of(o) != group) return {};
        return judge(o);
      };
    };
    table.share(fmt::format("one {} {:g} sigma: in the set", group, size), 0, 1, in_group(truths_in_sets));
    table.share(fmt::format("one {} {:g} sigma: named, nothing else", group, size), 0, 1,
                in_group([](const Outcome& o) { return exactly_the_truth(o, o.explanation); }));
  }
}

}  // namespace

std::vector<Metric> score(std::span<const Outcome> outcomes, const MetricOptions& options) {
  std::set<std::string> noises;
  for (const Outcome& outcome : outcomes) noises.insert(outcome.key.noise);
  std::vector<Metric> all;
  for (const std::string& noise : noises) {
    Table table(outcomes, noise);
    add_names(table);
    add_errors(table);
    add_rules(table);
    if (options.by_level || options.by_effect) add_details(table, outcomes, options);
    all.insert(all.end(), table.metrics.begin(), table.metrics.end());
  }
  return all;
}

}  // namespace tunnelrig::attribution
