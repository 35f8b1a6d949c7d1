// A step from the run on where it is likeliest.
#pragma once

#include "analysis/residual/likelihood/joint_fit.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace tunnelrig {

struct Placed {
  JointFit fit;
  std::optional<Observations> observations = {};  // what it speaks of, if these have changed
};

/// Of a term that is a step, counted from the newest (1), in a fit of `observations` to these rows; the fit
/// as it is where the term is none, or is there already. The column of a step with amplitudes of the groups'
/// own is a slope of the observations, and so they change with its place.
Placed at_best_run(const Observations& observations, JointFit fit, std::size_t from_newest,
                   const std::vector<int>& rows);

}  // namespace tunnelrig
