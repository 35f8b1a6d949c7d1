// Keys of TOML tables that nothing would read: a misspelt one must not pass in silence.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include <toml++/toml.h>

namespace tunnelrig {

/// Throws InputError naming file, line and key where `table` has a key that is not among `known`. `owner` is
/// what messages call the table.
void require_known_keys(const toml::table& table, const std::string& owner, const std::string& file,
                        std::initializer_list<std::string_view> known);

}  // namespace tunnelrig
