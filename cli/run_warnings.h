// What is said of a run that has ended, beside its line.
#pragma once

#include "daq/logger.h"

#include <string>

namespace tunnelrig::cli {

/// Warns of all that went wrong: an end before its time, losses, what could not be used, flags of the board,
/// its rate, clipped and stuck channels. True where something of it is a problem.
bool warn_of_run(const std::string& run, const LogOutcome& outcome, const CampaignInfo& info);

}  // namespace tunnelrig::cli
