// The ways in which effects are tried.
#pragma once

#include "analysis/residual/likelihood/terms.h"

#include <vector>

namespace tunnelrig {

/// What a step leaves on either side.
inline constexpr std::size_t kLeastBlocksBesideAStep = 3;
inline constexpr int kLeastRunsBesideAStep = 3;         // of groups that go on across it, all together
inline constexpr double kLeastShareBesideAStep = 0.05;  // of the runs: the ends of a long course are no step

/// Of rising numbers of rows those that leave so much on either side.
std::vector<int> rows_where_a_step_may_begin(const Observations& observations, const std::vector<int>& rows);

/// Those at which a group goes on across it, however little is left beside: where it is not sought, and may
/// be.
std::vector<int> rows_where_a_step_may_lie(const Observations& observations, const std::vector<int>& rows);

/// All ways to try an effect: rotors, shapes on their grids, change-points with three blocks of `rows` on
/// each side.
std::vector<Term> ways_to_try(const Effect& effect, const Observations& observations,
                              const std::vector<int>& rows);

}  // namespace tunnelrig
