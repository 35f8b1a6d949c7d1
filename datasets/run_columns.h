// The names of columns of runs.csv that the suite knows.
#pragma once

#include <string_view>

namespace tunnelrig {

/// The known column whose name differs from this one in nothing but capitals ("excluded" for "Excluded");
/// empty where there is none.
std::string_view known_but_for_case(std::string_view column);

}  // namespace tunnelrig
