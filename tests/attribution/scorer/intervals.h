// Intervals of a share that was counted, and of a mean.
#pragma once

#include <span>

namespace tunnelrig::attribution {

struct Interval {
  double low = 0, high = 1;
};

/// 95 % interval of a binomial share by Clopper and Pearson (1934): never covers less than it says.
Interval clopper_pearson(int successes, int trials);

/// 95 % interval by Wilson (1927): on average covers what it says.
Interval wilson(int successes, int trials);

/// Mean with its 95 % interval (normal), of two values or more; of fewer, without bounds.
struct MeanInterval {
  double mean = 0;
  Interval interval{-1e300, 1e300};
};
MeanInterval mean_interval(std::span<const double> values);

}  // namespace tunnelrig::attribution
