// Likelihood ratios of all candidates at once where the variances are held.
#pragma once

#include "analysis/residual/strata_fit.h"

#include <vector>

namespace tunnelrig {

/// Half of what each candidate takes of the weighted sum of squares beside the adopted columns: the first
/// term of its log likelihood ratio, in a hundredth of the time that fitting it with its own variances
/// takes (Rao 1948: the score test). Of `held` the variances count; `own`:
/// columns of each candidate.
Eigen::VectorXd score_ratios(const MixedModel& model, const ScanProducts& products,
                             const ScanProducts::Data& data, Eigen::Index set, const StrataFit::State& held,
                             const std::vector<Eigen::Index>& own);

}  // namespace tunnelrig
