// Whether a run resembles the run before it, beyond what they share as runs of one session.
#pragma once

#include "analysis/residual/likelihood.h"

#include <random>
#include <vector>

namespace tunnelrig {

/// For each stratum of runs' means, the correlation of neighbouring runs within their blocks (order of rows
/// is order of time) in residuals of a fitted model; 0 where it is within two standard deviations of what
/// independent runs show, and for courses. What the baseline takes from the residuals, and with it their
/// correlation, is allowed for by simulation: data of known correlation go the same way.
std::vector<double> run_correlation(const MixedModel& model, const NullFit& fit, const Components& residual,
                                    std::mt19937_64& random);

}  // namespace tunnelrig
