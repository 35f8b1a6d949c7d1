// When a motor of a table stood.
#pragma once

#include "datasets/observations.h"

#include <map>
#include <string>

namespace tunnelrig {

/// Of each group, rev/min: a speed of no more than that is a motor at rest, or a tachometer that read
/// nothing. 5 % of the upper quartile of the group's speeds above zero, so that one wild reading does not
/// make all others rest; 0 where the group has no speed.
std::map<std::string, double> resting_speeds_rpm(const ObservationTable& table);

}  // namespace tunnelrig
