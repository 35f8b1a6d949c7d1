#include "analysis/report/sections.h"

namespace tunnelrig::report {

Json model_section(const CampaignFile& file) {
  Json versions = Json::array();
  for (const Document& document : file.documents("model")) {
    const Json model = Json::parse(document.json);
    Json version = {{"version", versions.size() + 1},
                    {"created_utc", document.created_utc},
                    {"arguments", document.provenance.arguments},
                    {"explanation", model.at("explanation")}};
    versions.insert(versions.begin(), std::move(version));
  }
  return versions;
}

}  // namespace tunnelrig::report
