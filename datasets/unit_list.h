// All units of tables (units.h has how one is found and converted).
#pragma once

#include "datasets/units.h"

#include <span>

namespace tunnelrig {

/// In the order in which messages list them; of several names of one unit the first is the usual one.
std::span<const Unit> known_units();

}  // namespace tunnelrig
