// The live page: one HTML document with script, style and plots in it, as they were when the program was
// built.
#pragma once

#include <string_view>

namespace tunnelrig::live {

/// The page. It holds `{{token}}` once, where what the page sends along with its commands belongs, and
/// `{{nonce}}` at each script and style, for that of the answer's Content-Security-Policy.
std::string_view page_html();

}  // namespace tunnelrig::live
