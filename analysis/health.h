// What `doctor` looks at: whether a campaign file is whole, accounted for, and fit to be reduced and mapped.
#pragma once

#include "analysis/campaign_data.h"

#include <functional>
#include <string>
#include <vector>

namespace tunnelrig {

enum class Severity { kGood, kNote, kProblem };

/// One check: what was found, and what to do about it (empty where nothing is).
struct Finding {
  Severity severity = Severity::kGood;
  std::string check;
  std::string found;
  std::string advice;
};

/// Looks a campaign over. Reads every blob of raw data; `progress` is called with done and total runs.
std::vector<Finding> examine(const CampaignFile& file, const CampaignData& data,
                             const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace tunnelrig
