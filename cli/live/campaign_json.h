// The event `campaign`: locations, runs and maps as they stand.
#pragma once

#include "analysis/campaign_data.h"
#include "analysis/reduction.h"
#include "cli/live/position.h"
#include "daq/run_plan.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig::live {

struct CampaignStand {
  const CampaignData* data = nullptr;
  const Reduction* reduction = nullptr;       // null: nothing can be reduced yet
  std::map<std::string, std::uint64_t> lost;  // frames, by run
  std::vector<PlannedRun> plan;
  Position position;
  std::string maps = "null";  // JSON
  std::string maps_reason;    // why there are none; empty where there are
};

std::string campaign_json(const CampaignStand& stand);

/// Fits both maps, and samples them on 21 × 21 nodes: the JSON of `maps`. Throws InputError, in words for a
/// person, where there are none yet.
std::string maps_json(const CampaignData& data, const Reduction& reduction);

}  // namespace tunnelrig::live
