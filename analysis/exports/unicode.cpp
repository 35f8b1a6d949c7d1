#include "analysis/exports/unicode.h"

#include <algorithm>

namespace tunnelrig::exports {

std::u32string utf32(std::string_view utf8) {
  std::u32string points;
  for (std::size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i]);
    const std::size_t length = lead < 0x80 ? 1 : lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 0;
    char32_t point = length == 1 ? lead : lead & (0x7Fu >> length);
    bool good = length > 0 && i + length <= utf8.size();
    for (std::size_t k = 1; good && k < length; ++k) {
      const auto next = static_cast<unsigned char>(utf8[i + k]);
      good = (next & 0xC0u) == 0x80u;
      point = (point << 6u) | (next & 0x3Fu);
    }
    points.push_back(good ? point : U'\uFFFD');
    i += good ? length : 1;
  }
  return points;
}

bool is_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

}  // namespace tunnelrig::exports
