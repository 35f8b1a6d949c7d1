// What a flight leaves behind: its path, and the residual between the acceleration that the map predicts and
// the one measured.
#pragma once

#include "flight/controllers/controller.h"
#include "flight/vehicle/motors.h"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

struct LogRow {
  double time_s = 0;
  Plane reference_m{}, position_m{}, estimate_m{}, velocity_m_s{};
  double roll_rad = 0, roll_target_rad = 0, thrust_m_s2 = 0, x_m = 0;
};

/// Mean over half a second, one in one and a half. Predictions rest on the believed
/// vehicle and the measured map; measurements on the simulated inertial sensors.
struct ResidualRow {
  double time_s = 0;
  double y_norm = 0, z_norm = 0;
  Plane residual_m_s2{};  // measured less predicted acceleration in y and z
  double roll_residual_rad_s2 = 0, pitch_residual_rad_s2 = 0;
  double thrust_m_s2 = 0;      // predicted in undisturbed air, over the believed mass
  double map_thrust_m_s2 = 0;  // what the map adds to it
  double map_roll_rad_s2 = 0;  // angular acceleration that the map predicts
  double airspeed_m_s = 0;     // along the tunnel
  PerRotor rotor_thrust_N{};   // predicted in undisturbed air
};

struct FlightLog {
  int every = 8;  // cycles per row: 50 Hz
  std::vector<LogRow> rows;
  std::vector<ResidualRow> residuals;

  void reserve(double duration_s);
};

/// CSV with a header; lengths in metres, angles in radians.
std::string format_log(const FlightLog& log);

/// The residual table of several flights as `tunnelrig import --format table` reads it, in newtons and newton
/// metres of the believed vehicle, and its schema (docs/tables.md) for one response: "vertical", "lateral",
/// "roll" or "pitch". Throws InputError for another.
std::string format_residuals(std::span<const FlightLog> flights, const Airframe& believed);
std::string residual_schema(std::string_view response);

/// What a vehicle, its air or its map may have that nobody declared and that shows in this response:
/// candidates for `tunnelrig explain --effects`.
std::string residual_effects(std::string_view response, const Airframe& believed);

}  // namespace tunnelrig
