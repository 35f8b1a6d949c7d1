// UTF-8 as the formats want it. Private to exports/.
#pragma once

#include <string>
#include <string_view>

namespace tunnelrig::exports {

/// Code points; what is no UTF-8 becomes U+FFFD.
std::u32string utf32(std::string_view utf8);

bool is_ascii(std::string_view text);

}  // namespace tunnelrig::exports
