// What an import takes as it stands and a person had better look at.
#pragma once

#include "datasets/campaign.h"

#include <string>
#include <vector>

namespace tunnelrig {

/// A sentence each, naming file and line: keys of campaign.toml that nothing reads, columns of the user's
/// that one text makes a label, thrusts that no rotor of this size gives, a location at two places.
std::vector<std::string> import_doubts(const CampaignInfo& info, const Sheet& runs_sheet,
                                       const std::vector<Run>& runs);

}  // namespace tunnelrig
