// Which runs are in no tunnel, and are not meant to be.
#pragma once

#include "datasets/campaign.h"

namespace tunnelrig {

/// By its label (`OS`, `GND…`, `CEIL…`) or by a distance from ground or ceiling, where it has no place in a
/// tunnel.
bool in_open_space(const Run& run);

}  // namespace tunnelrig
