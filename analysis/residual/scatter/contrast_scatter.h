// Whether what rotors differ by scatters more in one way than in another: a roll that comes and goes.
#pragma once

#include "analysis/residual/likelihood/likelihood.h"

#include <random>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// Of four rotors: the scatter of each of their three contrasts (the model's modes behind the first) over the
/// geometric mean, in residuals of a model; empty where they differ by no more than alike ones do in all of
/// 200 simulated sets. A rotor that scatters more does so in all three alike. What goes with a condition is
/// allowed for, if it is known.
Eigen::VectorXd contrast_scatter(const Observations& observations, const std::vector<int>& rows,
                                 const Components& residual, std::mt19937_64& random);

}  // namespace tunnelrig
