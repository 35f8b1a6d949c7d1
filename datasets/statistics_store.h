// Run statistics in the campaign file.
#pragma once

#include "datasets/campaign_file.h"
#include "datasets/run_statistics.h"

#include <cstdint>
#include <map>

namespace tunnelrig {

/// Stores a run's statistics in place of those it had.
void store_statistics(CampaignFile& file, std::int64_t raw_run, const RunStatistics& statistics);

/// Statistics of all runs by raw run id, without the windows.
std::map<std::int64_t, RunStatistics> all_statistics(const CampaignFile& file);

/// Adds the windows of every run to what all_statistics returned.
void read_windows(const CampaignFile& file, std::map<std::int64_t, RunStatistics>& statistics);

}  // namespace tunnelrig
