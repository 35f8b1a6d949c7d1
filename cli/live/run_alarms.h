// The alarms that a finished run is marked with.
#pragma once

#include "cli/live/scale.h"
#include "daq/logger.h"

#include <string>

namespace tunnelrig::live {

inline constexpr double kTareDrift_N = 0.05;    // 0.7 % of a rotor's thrust at hover
inline constexpr double kTareDrift_V = 0.0125;  // before a calibration: the same for cells of 0.25 V/N
inline constexpr double kDiskLow_B = 500e6;     // a dozen hours of the rig

/// Kinds, "clipping;loss", from all of the run's frames, and `seen` while it was recorded (kinds likewise).
std::string alarms_of(const LogOutcome& outcome, const Scale& scale, const CampaignInfo& info,
                      const std::string& seen);

}  // namespace tunnelrig::live
