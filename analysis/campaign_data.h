// What the analysis needs of a campaign file, read once.
#pragma once

#include "calibration/certificate.h"
#include "datasets/campaign_file.h"
#include "datasets/raw_store.h"
#include "datasets/run_statistics.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

struct CampaignData {
  CampaignInfo info;
  std::vector<Run> runs;
  std::map<std::string, RawRun> raw;                // by run; runs given by their thrusts have none
  std::map<std::string, RunStatistics> statistics;  // by run
  std::optional<Certificate> certificate;
  std::int64_t certificate_id = 0;
};

/// Reads everything but raw data, and windows of the tares only.
CampaignData read_campaign_data(const CampaignFile& file);

/// Adds the windows within every run to the statistics.
void read_run_windows(const CampaignFile& file, CampaignData& data);

/// Computes the statistics of every raw run again from its frames, on two threads. `progress` is called with
/// done and total. Throws StorageError where raw data are damaged.
std::map<std::string, RunStatistics> statistics_from_raw(
    const std::filesystem::path& path, bool with_spectrum,
    const std::function<void(std::size_t, std::size_t)>& progress);

/// Where the stored statistics of a run are not those of its raw data, a line for each; empty where all
/// agree.
std::vector<std::string> disagreements(const std::map<std::string, RunStatistics>& stored,
                                       const std::map<std::string, RunStatistics>& computed);

}  // namespace tunnelrig
