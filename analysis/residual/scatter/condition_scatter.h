// Whether runs scatter more under some conditions than others: cells of constant error in newtons at low
// speed, gusts in much wind.
#pragma once

#include "analysis/residual/scatter/run_scatter.h"

#include <random>

namespace tunnelrig {

struct ScatterFit {
  RunScatter::ByCondition by_condition;
  NullFit variances;  // with it, beside the columns
};

/// What the runs of y scatter with beside a baseline and columns: e^(γz), z a condition, its logarithm, or
/// that of the response that is `predicted` (n × c); nothing where sizes of what is left go with a condition
/// no more than those of data sets whose runs are alike, or than the same dealt out anew.
ScatterFit condition_scatter(const Observations& observations, const std::vector<int>& rows,
                             const Components& y, const std::vector<Components>& columns,
                             const Eigen::MatrixXd& predicted, std::mt19937_64& random);

}  // namespace tunnelrig
