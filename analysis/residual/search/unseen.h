// How well models predict blocks of the runs that their fit did not see.
#pragma once

#include "analysis/residual/likelihood/cross_validation.h"
#include "analysis/residual/search/search_data.h"

#include <vector>

namespace tunnelrig {

/// Leave-one-block-out errors of a fit, weighted by these variances: two models are compared by those of one
/// of them, so that the difference is the means'.
CrossValidation unseen(const SearchData& data, const JointFit& fit, const NullFit& variances);

/// Of a fit to observations that differ from those of the search in slopes of the baseline.
CrossValidation unseen(const SearchData& data, const Observations& observations, const JointFit& fit,
                       const NullFit& variances);

/// Of what a fit's terms are, with these columns in place of its own.
CrossValidation unseen_with(const SearchData& data, const JointFit& base,
                            const std::vector<Components>& columns, const NullFit& variances);

/// Columns of the fit, and then these.
std::vector<Components> columns_with(const JointFit& base, const std::vector<Components>& more);

}  // namespace tunnelrig
