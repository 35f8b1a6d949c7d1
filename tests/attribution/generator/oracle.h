// What an analyst who knew the scatter and every effect's shape could see at best: the yardstick of what is
// asked.
#pragma once

#include "attribution/generator/sizing.h"

namespace tunnelrig::attribution {

/// Relative change of every ordinary run and rotor.
std::vector<Rotors> changes_of(const Effect& effect, double amplitude, const World& world);

/// Distance in standard deviations of `signal` from the baseline (free coefficients of locations and rotors,
/// random sessions, common and differing scatter of the rotors), with `other` fitted at its best amplitude,
/// which may be empty. Generalised least squares; the memory of autocorrelated scatter is left out.
double distance_sigma(const std::vector<Rotors>& signal, const std::vector<Rotors>& other, const World& world,
                      const NoiseModel& noise, bool one_coefficient);

}  // namespace tunnelrig::attribution
