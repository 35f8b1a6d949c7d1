// What says that some of many scatter more than the others, whatever they are: rotors, locations, sessions.
#pragma once

#include <cstddef>

namespace tunnelrig {

/// Data sets that are drawn of such as are alike: what differs lies beyond all of them.
inline constexpr std::size_t kAlikeSets = 200;

/// Of two, nothing says which of them scatters.
inline constexpr std::size_t kFewestToCompare = 3;

}  // namespace tunnelrig
