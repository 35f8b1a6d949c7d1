// What a flight leaves behind: its path, and the residual between the acceleration that the map predicts and
// the one measured.
#pragma once

#include "flight/controllers/controller.h"
#include "flight/vehicle/motors.h"

#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

struct LogRow {
  double time_s = 0;
  Plane reference_m{}, position_m{}, estimate_m{}, velocity_m_s{};
  double roll_rad = 0, roll_target_rad = 0, thrust_m_s2 = 0, x_m = 0;
};

/// Means over a tenth of a second. Predictions rest on the believed vehicle and the measured map;
/// measurements on the simulated inertial sensors.
struct ResidualRow {
  double time_s = 0;
  int block = 0;  // five seconds each
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

/// The residual table as `tunnelrig import --format table` reads it, in newtons and newton metres of the
/// believed vehicle, and its schema (docs/tables.md) for one response: "lift" (measured lift beside the
/// predicted one), or the residual "vertical", "lateral", "roll" or "pitch". Throws InputError for another.
std::string format_residuals(const FlightLog& log, const Airframe& believed);
std::string residual_schema(std::string_view response);

}  // namespace tunnelrig
