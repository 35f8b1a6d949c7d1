#include "analysis/exports/folder_files.h"

#include "analysis/exports/output_file.h"

#include <nlohmann/json.hpp>

namespace tunnelrig::exports {

void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json) {
  write_file(path, json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

void write_texts(const std::filesystem::path& folder, const std::vector<Attachment>& texts) {
  std::filesystem::create_directory(folder / "texts");
  for (const Attachment& document : texts)
    write_file(folder / "texts" / (document.name + "." + document.extension), document.text);
}

void write_provenance(const std::filesystem::path& folder,
                      const std::vector<std::pair<std::string, std::string>>& provenance) {
  nlohmann::ordered_json json;
  for (const auto& [key, text] : provenance) json[key] = text;
  write_json(folder / "provenance.json", json);
}

}  // namespace tunnelrig::exports
