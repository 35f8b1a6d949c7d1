// A time constant or a length beside amplitudes of the groups' own, which stand in the baseline: the
// likelihood of each value.
#pragma once

#include "analysis/residual/likelihood/joint_fit.h"

#include <cstddef>
#include <vector>

namespace tunnelrig {

struct ShapeProfile {
  double likeliest = 0, low = 0, high = 0;  // low, high: 95 % interval, within the parameter's bounds
};

/// Of parameter k of term t of a fit to these rows: amplitudes and variances are fitted anew at each value,
/// the model is linear about what they were. The interval is that of a likelihood ratio with Student's t of
/// as many degrees of freedom as there are blocks less one.
ShapeProfile shape_profile(const Observations& observations, const JointFit& fit, std::size_t t,
                           std::size_t k, const std::vector<int>& rows);

/// Parameters of that kind which a term has, by number.
std::vector<std::size_t> shapes_in_groups(const Term& term);

}  // namespace tunnelrig
