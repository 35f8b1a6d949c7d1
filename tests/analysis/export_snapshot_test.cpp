// An export is of one instant, whoever writes to the campaign file meanwhile.
#include "analysis/exports/export_campaign.h"
#include "analysis/run_summary.h"
#include "datasets/campaign_folder.h"
#include "datasets/error.h"
#include "datasets/sqlite.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

TEST(Export, IsOfOneInstant) {
  const test::TemporaryFolder folder;
  test::ExampleCampaign().write(folder / "source");
  ImportOptions options;
  options.summarizer = [](const CampaignInfo& info, const RawFormat& format) {
    return make_run_summarizer(info, format);
  };
  import_campaign_folder(folder / "source", folder / "c.db", options);
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  const auto spoil = [&](std::size_t done, std::size_t) {
    if (done > 1) return;
    CampaignFile(folder / "c.db", CampaignFile::Access::kWrite)
        .database()
        .execute("UPDATE raw_chunks SET data = zeroblob(length(data))");
  };
  const exports::Exported exported =
      exports::export_campaign(file, folder / "out", {.format = exports::Format::kNpy}, spoil);
  EXPECT_EQ(exported.recordings, 3u);
  EXPECT_THROW(exports::export_campaign(file, folder / "after", {.format = exports::Format::kNpy}),
               StorageError)
      << "the snapshot ends with the export";
}

}  // namespace
}  // namespace tunnelrig
