#pragma once

#include "analysis/run_summary.h"
#include "daq/logger.h"
#include "support/temporary_folder.h"

#include <atomic>
#include <string>

namespace tunnelrig::test {

inline SummarizerFactory summarizer() {
  return [](const CampaignInfo& info, const RawFormat& format) { return make_run_summarizer(info, format); };
}

inline RunCells cells(const std::string& run, const std::string& location = "OT") {
  return {{"run", run},
          {"location", location},
          {"repeat", "1"},
          {"session", "S1"},
          {"start_utc", "2026-03-02T08:00:00Z"},
          {"raw", "raw/" + run + ".npy"}};
}

/// A new campaign file of the reference rig.
inline CampaignFile new_campaign(const std::filesystem::path& path) {
  CampaignFile file(path, CampaignFile::Access::kRecord);
  file.set_text("campaign.toml", reference_campaign_toml());
  return file;
}

inline const std::atomic<bool>& never_stop() {
  static const std::atomic<bool> stop{false};
  return stop;
}

}  // namespace tunnelrig::test
