// How well the run under way is known so far: means with the error that autocorrelation leaves them.
#pragma once

#include "cli/live/scale.h"
#include "daq/live/running_blocks.h"

#include <functional>
#include <optional>
#include <vector>

namespace tunnelrig::live {

struct KnownMean {
  double mean = 0;
  std::optional<double> u95;  // nothing below eight blocks
};

struct RunningMeans {
  std::vector<KnownMean> rotors;  // newtons or volts
  std::optional<KnownMean> c_t, u_percent;
};

/// How the feed has them computed: by running_means, which needs more of the analysis than the feed does.
using MeansFunction = std::function<RunningMeans(const RunningBlocks&, const Scale&, const CampaignInfo&,
                                                 std::optional<double> air_temperature_C)>;

/// U95 of the run's own noise (run_summary's block means and Geyer's sequence), without calibration. C_T
/// needs newtons and the air's temperature; both need a positive total. Rotors that move together count as
/// such: the series of C_T and U are formed block by block.
RunningMeans running_means(const RunningBlocks& blocks, const Scale& scale, const CampaignInfo& info,
                           std::optional<double> air_temperature_C);

}  // namespace tunnelrig::live
