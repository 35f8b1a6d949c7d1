// Raw campaigns: what the converter reads during each run.
#pragma once

#include "attribution/generator/campaign.h"

namespace tunnelrig::attribution {

/// Writes raw/RUN.npy of every run, int16 counts of four channels at 1333.3 Hz.
void write_raw_runs(const Campaign& campaign, const std::filesystem::path& folder);

}  // namespace tunnelrig::attribution
