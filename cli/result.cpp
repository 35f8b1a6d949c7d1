#include "cli/result.h"

#include "cli/console.h"
#include "datasets/campaign_file.h"

#include <fmt/format.h>

namespace tunnelrig::cli {

void keep_result(const std::string& db, std::string_view kind, const std::string& inputs,
                 std::string_view json) {
  if (!can_be_changed(db)) {
    warn(fmt::format("{}: cannot be written, so this {} is not stored in it", db, kind));
    return;
  }
  CampaignFile(db, CampaignFile::Access::kWrite)
      .add_document(kind, {program_version(), arguments(), inputs}, json);
}

}  // namespace tunnelrig::cli
