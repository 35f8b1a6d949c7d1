// Candidate effects that a user writes as expressions in a TOML file; docs/effects.md has the format.
#pragma once

#include "analysis/effects/effect.h"

#include <filesystem>
#include <string>
#include <vector>

namespace tunnelrig {

/// The file's effects. Throws InputError with file, line and the rule that is broken.
std::vector<Effect> parse_effects_toml(const std::string& text, const std::string& file);
std::vector<Effect> read_effects_toml(const std::filesystem::path& path);

}  // namespace tunnelrig
