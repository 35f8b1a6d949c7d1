// Pictures of flights by gnuplot, in the manner of the thesis's Figures 6.16 to 6.18.
#pragma once

#include "cli/fly_output.h"

namespace tunnelrig::cli {

/// path.svg/.png (the path in the cross-section, contacts marked), error-y and error-z over time. `warning`
/// is set and nothing returned where gnuplot does not run.
std::vector<std::filesystem::path> draw_flown(const std::filesystem::path& folder, const FlownScenario& flown,
                                              const FlightTask& task, std::string& warning);

}  // namespace tunnelrig::cli
