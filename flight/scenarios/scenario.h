// Scenarios: the thesis's programme by name, or a file (docs/flight.md).
#pragma once

#include "flight/scenarios/space.h"
#include "flight/scenarios/trajectory.h"

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace tunnelrig {

struct Scenario {
  std::string name;
  std::string tunnel;  // where it flies when nothing else is asked for; empty: 1.5
  Trajectory trajectory;
  double score_from_s = 0;  // errors count from here on
};

/// The names that scenario_from knows beside files.
std::span<const std::string_view> scenario_names();

/// One of the thesis's scenarios in this tunnel: "hover" at its middle, "diagonal", "ladder", "circle",
/// "waypoints"; and "figure", which gains are tuned on and the thesis has not. The lengths printed for 1.5 m
/// and 2.4 m are taken where they are printed, else scaled to the room that there is. Anything else is a
/// file. Throws InputError for neither.
Scenario scenario_from(const std::string& name_or_file, const FlightSpace& space, const Airframe& frame);

/// The tunnel that a scenario asks for: of a file what it says, of a name the thesis's.
std::string tunnel_of_scenario(const std::string& name_or_file);

/// Throws InputError naming file, line and the rule broken.
Scenario parse_scenario(std::string_view toml, const std::string& file);

/// Throws InputError where the level vehicle, at rest at the start or later on its way, would be in a wall:
/// time, place and wall are named.
void check_scenario(const Scenario& scenario, const FlightSpace& space, const Airframe& frame);

}  // namespace tunnelrig
