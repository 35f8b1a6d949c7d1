// What `tunnelrig fly` prints and writes.
#pragma once

#include "flight/simulation/monte_carlo.h"

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace tunnelrig::cli {

inline constexpr const char* kFlightsFormat = "tunnelrig-flights/1";

/// What write_flown calls its files by.
inline constexpr std::array<const char*, 4> kResiduals = {"vertical", "lateral", "roll", "pitch"};
inline constexpr std::array<const char*, 3> kPictures = {"path", "error-y", "error-z"};

/// Of a scenario that is one of several.
std::string scenario_folder(const std::string& tunnel, const std::string& scenario);

/// One scenario in one tunnel, flown by several controllers.
struct FlownScenario {
  std::string tunnel, scenario;
  std::string extrapolated;  // what differs from the map's tunnel and vehicle; empty: nothing
  std::vector<Comparison> controllers;
  std::vector<FlightLog> logs;                         // the first run of each controller; may be empty
  std::string for_report;                              // flight_for_report
  std::vector<std::vector<FlightLog>> identification;  // by controller, for the residual tables; may be empty
};

/// What the report shows of a scenario (docs/report.md), as JSON: results, walls, reference, and the path of
/// each controller's first run, ten points a second. Needs the logs.
std::string flight_for_report(const FlownScenario& flown, const FlightTask& task, const std::string& map);

/// flights.json of several such, for `tunnelrig report --flights`.
std::string flights_json(const std::vector<std::string>& flights, const std::string& command);

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
