// Where a curve does what an effect does.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/search_data.h"

#include <vector>

namespace tunnelrig {

/// Whether a curve does nearly all that an effect's conditions do, so that a name beside it means nothing.
/// `made`: what the effect makes of its conditions per unit of its amplitude, on top of `predicted` (n × c).
bool is_work_of_a_curve(const SearchData& data, const std::vector<FoundCurve>& curves, const Term& term,
                        const Eigen::MatrixXd& made, const Eigen::MatrixXd& predicted);

/// Whether the newest curve, over a covariate of this effect or one that tells as much, has more of the
/// effect's size than its formula may leave: then the effect was only the curve's straight part. `term`: of
/// the fit.
bool outshone_by_curve(const SearchData& data, const Found& found, const Term& term);

}  // namespace tunnelrig
