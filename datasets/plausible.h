// What no rig gives: a value beyond is in another unit, or the rig is described wrongly.
#pragma once

#include "datasets/campaign.h"

namespace tunnelrig {

/// Beyond any rocket, and any reading of a converter, be it in counts of 32 bits.
inline constexpr double kMostForce_N = 1e9;
inline constexpr double kMostReading = 1e10;

/// T / (½ρΩ²R² πR²) of one rotor. The static points of the UIUC data base lie between 0.012 and 0.046.
inline constexpr double kMostRotorCoefficient = 0.3;

/// Least thrust of a turning rotor over the most.
inline constexpr double kLeastOverMostThrust = 0.01;

/// Most thrust of one rotor at sea level, N, whatever area the campaign's C_T is over.
double most_rotor_thrust_N(const Rig& rig, double speed_rpm);

/// The converter cannot have read these volts. A hair beyond the reference is the rounding of who made them.
bool beyond_converter(const Daq& daq, double volts);

}  // namespace tunnelrig
