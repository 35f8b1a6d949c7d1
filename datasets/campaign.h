// What a campaign is: the rig's geometry and electronics, its calibration points, and its runs.
// docs/campaign-folder.md describes the same things as files.
#pragma once

#include "datasets/csv.h"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tunnelrig {

inline constexpr int kMaxRotors = 4;

/// Geometry of the vehicle. Rotors are numbered as ArduCopter's quad-X: 1 front right, 2 rear left, 3 front
/// left, 4 rear right; 1 and 2 turn counter-clockwise, 3 and 4 clockwise. y points right, towards the near
/// wall.
struct Rig {
  int rotors = kMaxRotors;
  double propeller_radius_m = 0.1524;
  double rotor_area_m2 = 0;  // of the thrust coefficient; one propeller disc unless the campaign says else
  double arm_length_m = 0.31;
  double vehicle_width_m = 0;   // tip to tip, w_q
  double vehicle_height_m = 0;  // h_q
  double nominal_speed_rpm = 5000;
  double blade_chord_m = 0.025;
  int blades = 2;              // of a propeller: the blade-pass line is so many times the shaft's
  double cell_limit_N = 9.81;  // what a load cell may carry: 1 kg
};

struct Tunnel {
  double width_m = 1.5;   // w_t
  double height_m = 1.5;  // h_t
};

inline constexpr double kUsualMains_hz = 50;      // of most grids
inline constexpr double kSpeedTolerance = 0.003;  // of the nominal speed, the thesis's ±15 rev/min

struct Daq {
  double sample_rate_hz = 4000.0 / 3.0;
  int adc_bits = 12;
  double adc_reference_V = 3.3;
  std::optional<double> mains_hz;  // of the grid, where it was said

  /// volts = counts · adc_reference_V / 2^adc_bits
  double volts_per_count() const;
  int highest_count() const;  // 2^adc_bits − 1; it and 0 are the clipped codes
};

/// Standard uncertainties (k = 1) of the instruments, where the campaign declares them.
struct InstrumentUncertainty {
  std::optional<double> speed_rpm;
  std::optional<double> air_temperature_K;
  std::optional<double> air_pressure_Pa;
  std::optional<double> force_N;
};

/// campaign.toml.
struct CampaignInfo {
  std::string name;
  Rig rig;
  std::optional<Tunnel> tunnel;  // absent: open space only
  Daq daq;
  InstrumentUncertainty uncertainty;
  std::string toml;  // the document as it was written, which export gives back
  std::vector<std::string>
      unread;  // sentences of tables and keys in it that nothing reads, with file and line
};

/// Parses campaign.toml. Throws InputError naming file, line and key for a missing or unknown format, a value
/// of the wrong type, or one that no rig has (a radius of 152.4 "m" is millimetres).
CampaignInfo parse_campaign_toml(const std::string& text, const std::string& file);

/// The thesis's rig, as a campaign.toml; what `log` starts a new file from when it is given none.
std::string reference_campaign_toml();

/// One row of calibration.csv.
struct CalibrationPoint {
  int cell = 1;
  double applied_force_N = 0;
  double voltage_V = 0;
  std::optional<int> sequence;
  std::string direction;  // "up", "down" or empty
  std::optional<double> air_temperature_C;
  int line = 0;
};
std::vector<CalibrationPoint> parse_calibration(const Sheet& sheet, int rotors);

/// One row of propellers.csv.
struct PropellerTest {
  std::string propeller;
  int rotor = 1;
  std::string direction;  // "CW" or "CCW"
  double thrust_N = 0;
  int line = 0;
};
std::vector<PropellerTest> parse_propellers(const Sheet& sheet, int rotors);

enum class RunKind { kThrust, kTare };

/// One row of runs.csv, typed. Columns that the suite does not know are covariates where every filled cell is
/// a number, labels otherwise.
struct Run {
  std::string run;
  std::string location;
  int repeat = 1;
  std::string session;
  double start_s = 0;  // seconds since 1970-01-01T00:00Z
  std::string raw;     // path of the raw file within the folder; empty where thrusts are given
  RunKind kind = RunKind::kThrust;
  std::optional<double> y_norm, z_norm;  // −1 to 1, normalised tunnel coordinates (4.1, 4.2)
  std::array<std::optional<double>, kMaxRotors> thrust_N;
  std::string excluded;  // why the run is left out of what is derived; empty: it is not
  std::string note;      // remarks, one a line
  std::string alarms;    // what was wrong while it was recorded: "clipping;loss"
  std::map<std::string, double, std::less<>> numbers;      // every numeric column that has a value
  std::map<std::string, std::string, std::less<>> labels;  // every text column that has a value
  std::size_t row = 0;                                     // in the sheet
  int line = 0;

  std::optional<double> number(std::string_view column) const;
  bool in_tunnel() const { return y_norm.has_value() && z_norm.has_value(); }
};

/// The same campaign at the speed that a run was measured at, where it was: its shaft is looked for there.
CampaignInfo at_speed(CampaignInfo campaign, std::optional<double> measured_rpm);

/// Lowest and highest value that a column of runs.csv can hold, where its unit fixes them.
std::optional<std::pair<double, double>> range_of(std::string_view column);

/// Why a column of runs.csv cannot hold a value, in words: its range, and the unit that is meant. Empty where
/// it can; any number can stand in a column that the suite does not know.
std::string outside_range(std::string_view column, double value);

/// Parses runs.csv. Throws InputError naming file, line and column for a missing required column, a run named
/// twice, a number that does not parse, or a value outside what its unit allows.
std::vector<Run> parse_runs(const Sheet& sheet, const CampaignInfo& campaign);

/// ISO 8601 date and time to seconds since 1970, UTC; nothing where it is none. A time without zone is UTC.
std::optional<double> parse_utc(std::string_view text);

/// "2026-03-02T08:00:00Z", with milliseconds where they are not zero.
std::string format_utc(double seconds);

/// Now, in seconds since 1970, UTC.
double utc_seconds();

}  // namespace tunnelrig
