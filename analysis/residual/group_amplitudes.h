// An effect's amplitude where each group has its own.
#pragma once

#include "analysis/residual/joint_fit.h"

#include <string>
#include <vector>

namespace tunnelrig {

struct GroupEstimate {
  std::string group;
  double value = 0, low = 0, high = 0;  // 95 %
};

/// Of term t of the model, from `rows`, which scatter as `variances` say; without groups that have too few of
/// them, or in which the baseline absorbs what the effect does (a moment that is always its force times one
/// arm).
std::vector<GroupEstimate> estimate_by_group(const Observations& observations, const MeanModel& model,
                                             std::size_t t, const NullFit& variances,
                                             const std::vector<int>& rows);

}  // namespace tunnelrig
