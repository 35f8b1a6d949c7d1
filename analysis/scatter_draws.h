// How large the scatter between visits and sessions may be, where few of them say so.
#pragma once

#include "analysis/variance_components.h"

#include <cstddef>

#include <Eigen/Core>

namespace tunnelrig {

struct VisitDesign;

/// Draws of what a run's visit and session vary by together, from the restricted likelihood. The prior of
/// each variance s is 1/√(s (c + s)), c being what estimates of s would scatter by if s were 0: flat in √s
/// far below c, where data say little of s, and in ln s far above it, where intervals of balanced designs are
/// thereby Student's. `components` has the variances at the likelihood's maximum.
ScatterDraws draw_scatter(const VisitDesign& design, const VarianceComponents& components);

/// The degrees of freedom by which t(0.975, ν) standard errors hold a normal error with 95 %, whose variance
/// is `run_part` (known to `run_dof`) plus `concentration` times a draw, and `variance` at the typical ones.
/// Not below 1.
double dof_of(const ScatterDraws& draws, double run_part, double run_dof, double concentration,
              double variance);

}  // namespace tunnelrig
