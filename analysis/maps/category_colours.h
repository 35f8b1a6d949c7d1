#pragma once

#include <array>

namespace tunnelrig {

/// Okabe and Ito's colours, which the colour-blind can tell apart, dark ones first.
inline constexpr std::array kCategoryColours = {"#0072B2", "#D55E00", "#009E73",
                                                "#CC79A7", "#E69F00", "#56B4E9"};

}  // namespace tunnelrig
