// The results of a series that several processes flew, brought together.
#pragma once

#include "flight/simulation/monte_carlo.h"
#include "flight/simulation/processes.h"

#include <array>
#include <vector>

namespace tunnelrig {

/// Process r of n has flown runs r, r + n, …; afterwards every one has all runs, and `pooled` counts the
/// errors of all.
void exchange_runs(const Processes& processes, std::vector<RunResult>& runs,
                   std::array<AxisErrors, 2>& pooled);

}  // namespace tunnelrig
