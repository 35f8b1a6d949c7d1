// Whether runs scatter more under some conditions than others: cells of constant error in newtons at low
// speed, gusts in much wind.
#pragma once

#include "analysis/residual/run_scatter.h"

#include <random>

namespace tunnelrig {

/// Lets `known` go with one condition more, or more with one that it has: where `sizes`, of a model with what
/// is known, do, beside those of data sets whose runs are alike, and beside the same dealt out anew. A run's
/// scatter goes with e^(γz), z a condition, its logarithm, or that of the response that is `predicted` (n ×
/// c).
bool let_scatter_differ(const Observations& observations, const RunSizes& sizes,
                        const Eigen::MatrixXd& predicted, std::mt19937_64& random,
                        RunScatter::ByCondition& known);

}  // namespace tunnelrig
