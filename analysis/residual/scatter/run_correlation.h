// Whether a run resembles the run before it, beyond what they share as runs of one session.
#pragma once

#include "analysis/residual/likelihood/likelihood.h"

#include <array>
#include <random>

namespace tunnelrig {

/// Of what rotors have in common, and of what they differ by: the correlation of neighbouring runs within
/// their blocks (order of rows is order of time) in residuals of a model that was fitted without any; 0 where
/// it is within two standard deviations of what independent runs show, or where data of a known one would
/// show none. What the baseline takes from the residuals, and with it their correlation, is allowed for by
/// simulation. Elsewhere it is the likeliest by restricted likelihood, with the session variance that is
/// likeliest beside it: independent runs would have sessions differ by what correlated ones drift.
/// `model`: of `observations`, and `fit` its.
std::array<double, 2> run_correlation(const Observations& observations, const MixedModel& model,
                                      const NullFit& fit, const Components& residual,
                                      std::mt19937_64& random);

/// Of a table's rows, which are independent in the model: the correlation of what is left of a row with what
/// is left of the one before it in `rows`, where both are of one group. 0 within three standard deviations of
/// that of independent rows.
double row_correlation(const Observations& observations, const std::vector<int>& rows,
                       const Eigen::VectorXd& residual);

}  // namespace tunnelrig
