// What truly happened around each run of a generated campaign, before anything was measured.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace tunnelrig::attribution {

inline constexpr std::size_t kRotors = 4;
inline constexpr double kNominalSpeed_rpm = 5000;
inline constexpr double kRadius_m = 0.1524;
inline constexpr double kChord_m = 0.025;
inline constexpr double kStandardPressure_Pa = 101325;
inline constexpr double kGasConstant_J_kgK = 287.058;

// Load cells and converter: volts = zero + gain * force.
inline constexpr double kZero_V = 0.34;
inline constexpr double kGain_V_N = 0.242;
inline constexpr double kFullScale_V = 3.3 * 4095 / 4096;
inline constexpr std::size_t kBladeSets = 3;
inline constexpr double kFar_R = std::numeric_limits<double>::infinity();

/// One run. Members that end up in a column of runs.csv have the column's name.
struct Conditions {
  int session = 0;
  double start_s = 0;         // since 1970
  double session_time_h = 0;  // since the session's first run
  std::string location;
  int repeat = 1;
  bool in_tunnel = false;
  bool first_of_session = false;
  double ground_distance_R = kFar_R, ceiling_distance_R = kFar_R;
  double speed_rpm = kNominalSpeed_rpm;
  double air_temperature_C = 20, air_pressure_Pa = kStandardPressure_Pa, relative_humidity = 0.5;
  double supply_voltage_V = 15, tunnel_airspeed_m_s = 0, cell_temperature_C = 22;
  double time_since_motor_start_s = 60;
  double time_of_day_h = 12, cable_slack_mm = 0;  // columns of a laboratory's own
  double fan_on = 0;                              // 0 or 1
  std::size_t blade_set = 0;                      // which of kBladeSets; a letter in runs.csv
  double speed_factor = 1;  // thrust of a speed that was chosen, over that of the nominal speed
  bool added = false;       // of a session that was added to tell two effects apart
  bool proposed = false;    // brought to a setting that shall tell two effects apart
  double vibration = 0;     // strength of the shaft's line where a cell resonates, raw campaigns
};

using Rotors = std::array<double, kRotors>;

struct World {
  int blocks = 0;  // sessions of the campaign as planned; runs added later are not counted
  std::vector<Conditions> runs;
  std::vector<Rotors> baseline_N;  // k_i c_i 0.5 rho Omega^2 R^2 A, what the model `thesis` says
};

/// 0.5 rho Omega^2 R^2 A at the nominal speed and standard pressure: thrust over coefficient, N.
double dynamic_thrust_N(double air_temperature_C);

}  // namespace tunnelrig::attribution
