#include "cli/live/scale.h"

namespace tunnelrig::live {

Scale scale_of(const CellKnowledge& cells, const CampaignInfo& info, const std::string& session) {
  Scale scale{.newtons = cells.certificate.has_value()};
  const double volts = info.daq.volts_per_count();
  const auto tare = cells.tares.find(session);
  for (int rotor = 0; rotor < info.rig.rotors; ++rotor) {
    const auto i = static_cast<std::size_t>(rotor);
    if (!cells.certificate) {
      scale.slope[i] = volts;
      continue;
    }
    const auto zero = tare == cells.tares.end() ? std::nullopt : std::optional(tare->second.mean_V[i]);
    const double factor = cells.certificate->propellers.factor(rotor);
    const ForceReading at_zero = cells.certificate->force(rotor + 1, 0, zero);
    scale.slope[i] = at_zero.d_voltage_N_per_V * volts / factor;
    scale.offset[i] = at_zero.force_N / factor;
  }
  return scale;
}

}  // namespace tunnelrig::live
