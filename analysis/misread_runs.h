// Runs whose raw data are not what their row says, and that would pass into every zero or mean.
#pragma once

#include "analysis/campaign_data.h"

#include <string>
#include <vector>

namespace tunnelrig {

struct MisreadRuns {
  std::vector<std::string> loaded_tares;  // read like thrust runs: a motor was on
  std::vector<std::string> broken_off;    // thrust runs that are not one state: a motor stopped within them
};

/// By forces of the calibration alone, since the zeros are in question; nothing where there is none. A tare
/// is loaded where most rotors read more than half of what they do in the median thrust run, less the median
/// tare's. A run is broken off where the standard error of a rotor's mean is above 5 % of that thrust: noise
/// and turbulence leave a tenth of it.
MisreadRuns misread_runs(const CampaignData& data);

/// A sentence for either kind; none where there is none.
std::vector<std::string> in_words(const MisreadRuns& runs);

}  // namespace tunnelrig
