// A font inside an SVG picture, so that it looks the same where the font is not installed.
#pragma once

#include <string>

namespace tunnelrig::report {

/// The family that "sans" stands for on this computer, as gnuplot's other terminals draw it; "sans-serif"
/// where no font is installed.
std::string figure_font_family();

/// The picture with the glyphs of that family that its texts need, as a font in a style element (20 to 30
/// kB). As it was where no font is installed.
std::string with_embedded_font(std::string svg);

}  // namespace tunnelrig::report
