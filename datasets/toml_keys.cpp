#include "datasets/toml_keys.h"

#include "datasets/error.h"

#include <algorithm>

namespace tunnelrig {

void require_known_keys(const toml::table& table, const std::string& owner, const std::string& file,
                        std::initializer_list<std::string_view> known) {
  for (const auto& [key, value] : table)
    if (std::find(known.begin(), known.end(), key.str()) == known.end())
      throw InputError::at(file, static_cast<int>(key.source().begin.line),
                           "{}: {} is no key here; known are {}", owner, key.str(), fmt::join(known, ", "));
}

}  // namespace tunnelrig
