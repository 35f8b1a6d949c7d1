// The metrics of the benchmark, each beside its target.
#pragma once

#include "attribution/scorer/intervals.h"
#include "attribution/scorer/outcome.h"

#include <span>

namespace tunnelrig::attribution {

struct Metric {
  std::string name;
  std::string noise;  // or "all"
  double low_target = 0, high_target = 1;
  bool is_share = true;  // of `count` campaigns (or intervals); else a mean over them
  int successes = 0, count = 0;
  double value = 0;
  Interval interval;  // 95 %, Clopper-Pearson of a share, normal of a mean
  Interval narrow;    // of a share: Wilson

  /// The interval meets the target.
  bool met() const { return count > 0 && interval.high >= low_target && interval.low <= high_target; }
};

struct MetricOptions {
  bool by_level = false;  // one effect: also apart for those that vary by run and by session
  bool by_effect = false;
};

/// Every metric for every noise that occurs. Campaigns of 16 randomised sessions or more count, except where
/// five blocks or fewer are the question. A campaign that `explain` failed on counts against it everywhere.
std::vector<Metric> score(std::span<const Outcome> outcomes, const MetricOptions& options = {});

}  // namespace tunnelrig::attribution
