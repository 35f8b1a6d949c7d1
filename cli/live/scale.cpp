#include "cli/live/scale.h"

namespace tunnelrig::live {

Scale scale_of(const CellKnowledge& knowledge, const CampaignInfo& info, const std::string& session) {
  Scale scale{.newtons = knowledge.cells.has_value()};
  const double volts = info.daq.volts_per_count();
  const auto tare = knowledge.tares.find(session);
  for (std::size_t i = 0; i < static_cast<std::size_t>(info.rig.rotors); ++i) {
    if (!knowledge.cells) {
      scale.slope[i] = volts;
      continue;
    }
    const CalibratedCell& cell = (*knowledge.cells)[i];
    const double zero_V = tare == knowledge.tares.end() ? cell.zero_V : tare->second.mean_V[i];
    scale.slope[i] = cell.newtons_per_V * volts;
    scale.offset[i] = -cell.newtons_per_V * zero_V;
  }
  return scale;
}

}  // namespace tunnelrig::live
