// Whether one rotor's sessions differ more than the others': a tare that repeats badly, a cell mounted anew.
#pragma once

#include "analysis/residual/likelihood/likelihood.h"

#include <random>
#include <vector>

namespace tunnelrig {

/// Modes in which runs and sessions are both uncorrelated, though sessions differ more in some rotors, found
/// in residuals of a model; empty where they differ alike. The most unlike rotor gets a session variance of
/// its own where the likelihood gains more by it than in all of 200 simulated sets, then the next of those
/// left, while three are left. The rest of `observations.scatter` is known.
RotorSessions rotor_sessions(const Observations& observations, const std::vector<int>& rows,
                             const Components& residual, std::mt19937_64& random);

}  // namespace tunnelrig
