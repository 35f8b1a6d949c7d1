// What `tunnelrig fly` prints and writes.
#pragma once

#include "flight/simulation/monte_carlo.h"

#include <filesystem>
#include <string>
#include <vector>

namespace tunnelrig::cli {

/// One scenario in one tunnel, flown by several controllers.
struct FlownScenario {
  std::string tunnel, scenario;
  std::vector<Comparison> controllers;
  std::vector<FlightLog> logs;                         // the first run of each controller; may be empty
  std::vector<std::vector<FlightLog>> identification;  // by controller, for the residual tables; may be empty
};

void print_flown(const FlownScenario& flown);

/// The object that docs/flight.md describes.
std::string flown_json(const std::vector<FlownScenario>& flown, const std::string& map, std::uint64_t seed,
                       bool programme);

/// The thesis's results (6.3) beside ours, where it has one.
void print_beside_thesis(const std::vector<FlownScenario>& flown);

/// Logs, residual tables with schemas, the comparison as CSV, and pictures. Returns what was written;
/// `warning` is set where the pictures could not be made.
std::vector<std::filesystem::path> write_flown(const std::filesystem::path& folder,
                                               const FlownScenario& flown, const FlightTask& task,
                                               std::string& warning);

}  // namespace tunnelrig::cli
