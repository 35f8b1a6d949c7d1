#include "cli/live/run_alarms.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig::live {

std::string alarms_of(const LogOutcome& outcome, const Scale& scale, const CampaignInfo& info,
                      const std::string& seen) {
  std::set<std::string> kinds;
  for (std::size_t at = 0; at < seen.size();) {
    const std::size_t end = std::min(seen.find(';', at), seen.size());
    kinds.insert(seen.substr(at, end - at));
    at = end + 1;
  }
  const double volts = info.daq.volts_per_count();
  const auto rotors = static_cast<std::size_t>(info.rig.rotors);
  for (std::size_t c = 0; c < std::min(rotors, outcome.statistics.channels.size()); ++c) {
    const ChannelStatistics& channel = outcome.statistics.channels[c];
    if (channel.clipped > 0) kinds.insert("clipping");
    if (channel.stuck())
      kinds.insert("stuck");
    else if (channel.std_V < kDeadNoise_counts * volts)
      kinds.insert("dead");
    const double most_N = std::max(std::abs(scale.value(c, channel.lowest_V / volts)),
                                   std::abs(scale.value(c, channel.highest_V / volts)));
    if (scale.newtons && most_N > info.rig.cell_limit_N) kinds.insert("overload");
  }
  if (outcome.ledger.frames_clipped > 0) kinds.insert("clipping");
  if (outcome.ledger.frames_test_pattern > 0) kinds.insert("test_pattern");
  if (outcome.ledger.frames_lost > 0) kinds.insert("loss");
  if (outcome.ledger.silences > 0) kinds.insert("silent");
  return fmt::format("{}", fmt::join(kinds, ";"));
}

}  // namespace tunnelrig::live
