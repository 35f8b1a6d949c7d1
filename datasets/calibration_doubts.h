// Calibration points in another unit than volts and newtons, or in each other's column.
#pragma once

#include "datasets/campaign_file.h"

#include <string>
#include <vector>

namespace tunnelrig {

/// At most one sentence, naming a line or a cell: readings beyond the converter's reference; loads that
/// neither a rotor of this rig gives nor a cell of it carries; or, where runs are recorded, a line through a
/// cell's points that makes more of them than such a rotor gives. `points` need not be those of the file.
std::vector<std::string> calibration_doubts(const CampaignFile& file,
                                            const std::vector<CalibrationPoint>& points);

}  // namespace tunnelrig
