// What a page may ask for: the body of POST /command (docs/live.md).
#pragma once

#include "datasets/campaign.h"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace tunnelrig::live {

struct Command {
  std::string name;   // start, stop, tare, next, note, redo, exclude, include, metadata, target
  std::string token;  // not yet checked
  std::string location, session, run, text, reason;
  std::optional<RunKind> kind;
  std::optional<int> repeat;
  std::optional<double> duration_s;
  std::map<std::string, std::optional<double>> values;  // of metadata; nothing: as if never said
  std::optional<double> c_t_u95, u_percent_u95;
};

/// What became of a command: `problem` says what prevents it (empty where all is well), `text` what was done.
struct CommandResult {
  std::string problem, text;
};

/// Throws InputError, in words for the person at the page, for text that is no JSON object, an unknown
/// command or key, a value of the wrong type or out of its range, a label that is too long.
Command parse_command(std::string_view body);

/// A quantity that the operator reads off an instrument; a column of the sheet of runs, with its range.
struct MetadataField {
  const char* name;
  const char* label;
  const char* unit;
};
inline constexpr std::array<MetadataField, 6> kMetadata = {
    {{"speed_rpm", "Rotor speed", "rev/min"},
     {"air_temperature_C", "Air temperature", "°C"},
     {"air_pressure_Pa", "Air pressure", "Pa"},
     {"relative_humidity", "Relative humidity", "0 to 1"},
     {"supply_voltage_V", "Supply voltage", "V"},
     {"time_since_motor_start_s", "Since the motors started", "s"}}};

}  // namespace tunnelrig::live
