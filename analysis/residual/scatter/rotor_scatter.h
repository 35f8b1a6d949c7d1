// Whether one rotor scatters more than another: a worn bearing, a loose cell, a noisy amplifier.
#pragma once

#include "analysis/residual/likelihood/likelihood.h"

#include <random>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// Standard deviation of what each rotor's runs have of their own, over the rotors' geometric mean, in
/// residuals of a model; empty where they differ by no more than alike rotors' do. The most unlike rotor gets
/// a scatter of its own where it is beyond all of 200 simulated sets, then the next of those left, down to
/// two of which nothing says which one scatters; the others share one. From mean absolute values: a single
/// wild run is not a rotor's scatter. What goes with a condition is allowed for, if it is known.
Eigen::VectorXd rotor_scatter(const Observations& observations, const std::vector<int>& rows,
                              const Components& residual, std::mt19937_64& random);

}  // namespace tunnelrig
