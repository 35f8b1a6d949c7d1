// What is flown: a named trajectory in a tunnel; the thesis's programme, and files (docs/flight.md).
#pragma once

#include "flight/scenarios/space.h"
#include "flight/scenarios/trajectory.h"

#include <span>
#include <string>
#include <string_view>

namespace tunnelrig {

struct Scenario {
  std::string name;
  std::string tunnel;  // that a file asks for; empty where it does not
  Trajectory trajectory;
  double score_from_s = 0;  // errors count from here on; contacts always
};

/// hover, diagonal, ladder, circle, waypoints: the thesis's (6.3). "training", which gains are tuned on, and
/// "identification", which tells undeclared effects apart, are none of them.
std::span<const std::string_view> scenario_names();

/// By name, fitted to the space, or from the file of that name. Throws InputError for neither, and what
/// parse_scenario throws.
Scenario scenario_from(const std::string& name_or_file, const FlightSpace& space, const Airframe& frame);

/// The tunnel that a scenario's file asks for; empty for a scenario of the programme, or where it does not.
std::string tunnel_of_scenario(const std::string& name_or_file);

/// Throws InputError naming file, line and the rule broken.
Scenario parse_scenario(std::string_view text, const std::string& file);

/// Throws InputError naming place and time where the vehicle, level on the path, starts inside a wall or
/// leaves the tunnel.
void check_scenario(const Scenario& scenario, const FlightSpace& space, const Airframe& frame);

}  // namespace tunnelrig
