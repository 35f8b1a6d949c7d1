// The ways in which effects are tried.
#pragma once

#include "analysis/residual/likelihood/terms.h"

#include <vector>

namespace tunnelrig {

/// Blocks that a step leaves on either side.
inline constexpr int kLeastBlocksBesideAStep = 3;
inline constexpr double kLeastShareBesideAStep = 0.05;  // of the runs: the ends of a long course are no step

/// All ways to try an effect: rotors, shapes on their grids, change-points with three blocks of `rows` on
/// each side.
std::vector<Term> ways_to_try(const Effect& effect, const Observations& observations,
                              const std::vector<int>& rows);

}  // namespace tunnelrig
