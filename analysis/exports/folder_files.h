// What the formats that are a folder write alike. Private to exports/.
#pragma once

#include "analysis/exports/contents.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tunnelrig::exports {

// All throw InputError naming the file where it cannot be written.

/// Indented; bytes that are no UTF-8 become the character that says so.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json);

/// texts/NAME.EXTENSION
void write_texts(const std::filesystem::path& folder, const std::vector<Attachment>& texts);

/// provenance.json
void write_provenance(const std::filesystem::path& folder,
                      const std::vector<std::pair<std::string, std::string>>& provenance);

}  // namespace tunnelrig::exports
