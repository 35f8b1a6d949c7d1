#pragma once

#include <cstddef>
#include <string_view>

namespace tunnelrig::test {

/// How often `part` stands in `text`.
inline std::size_t occurrences(std::string_view text, std::string_view part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

}  // namespace tunnelrig::test
