#include "datasets/campaign.h"
#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/lower_case.h"
#include "datasets/plausible.h"
#include "datasets/run_columns.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>

namespace tunnelrig {
namespace {

/// A column whose unit fixes what it can hold. `hint` says what a value outside probably is.
struct KnownColumn {
  std::string_view name;
  double lowest, highest;
  std::string_view hint;
};

constexpr double kLarge = 1e12;
constexpr std::array<KnownColumn, 17> kKnown = {{
    {"y_norm", -1, 1, "normalised tunnel coordinates lie between -1 and 1"},
    {"z_norm", -1, 1, "normalised tunnel coordinates lie between -1 and 1"},
    {"ground_distance_R", 0, 10000, "a distance in propeller radii"},
    {"ceiling_distance_R", 0, 10000, "a distance in propeller radii"},
    {"speed_rpm", 0, 200000, "a rotation speed in rev/min"},
    {"air_temperature_C", -80, 80, "degrees Celsius, not kelvin or Fahrenheit"},
    {"cell_temperature_C", -80, 200, "degrees Celsius, not kelvin or Fahrenheit"},
    {"air_pressure_Pa", 30000, 120000, "pascal, not hectopascal or millibar"},
    {"relative_humidity", 0, 1, "a fraction from 0 to 1, not per cent"},
    {"supply_voltage_V", 0, 1000, "volts, not millivolts"},
    {"tunnel_airspeed_m_s", -200, 200, "metres per second"},
    {"time_since_motor_start_s", 0, 1e7, "seconds at the first frame"},
    {"duration_s", 0, 1e6, "seconds over which a row's thrusts are means"},
    {"thrust_1_N", -kLarge, kLarge, "newtons"},
    {"thrust_2_N", -kLarge, kLarge, "newtons"},
    {"thrust_3_N", -kLarge, kLarge, "newtons"},
    {"thrust_4_N", -kLarge, kLarge, "newtons"},
}};

constexpr std::array<std::string_view, 10> kText = {"run",  "location", "session",  "start_utc", "raw",
                                                    "kind", "repeat",   "excluded", "note",      "alarms"};

const KnownColumn* known_column(std::string_view name) {
  const auto* found =
      std::find_if(kKnown.begin(), kKnown.end(), [&](const auto& k) { return k.name == name; });
  return found == kKnown.end() ? nullptr : found;
}

[[noreturn]] void refuse_unit(const Sheet& sheet, const std::string& column, std::string_view ours) {
  throw InputError::at(sheet.file, 1,
                       "column {}: this quantity is read as {}; convert it and rename the column", column,
                       ours);
}

/// Such a column in place of ours is a mistake, not a covariate. A distance may be the label's, as radii.
void check_units(const Sheet& sheet) {
  for (const std::string& column : sheet.columns) {
    const std::string_view ours = in_our_unit(column);
    if (known_column(ours) == nullptr || ours.ends_with("_R") || sheet.find(ours)) continue;
    refuse_unit(sheet, column, ours);
  }
}

/// Of another sheet, a required column that stands there in another unit.
void require_in_our_unit(const Sheet& sheet, std::string_view ours) {
  if (sheet.find(ours)) return;
  const std::string_view quantity = ours.substr(0, ours.rfind('_') + 1);
  for (const std::string& column : sheet.columns)  // voltage_mV, and no voltage_offset_mV
    if (column.starts_with(quantity) && column.find('_', quantity.size()) == std::string::npos)
      refuse_unit(sheet, column, ours);
}

/// Numbers among what may be no number; labels else.
bool has_numbers(const Sheet& sheet, std::size_t column) {
  std::size_t numbers = 0, filled = 0;
  for (const Sheet::Row& row : sheet.rows) {
    const std::string& cell = row.cells[column];
    if (cell.find_first_not_of(" \t") == std::string::npos) continue;
    ++filled;
    if (parse_number(cell))
      ++numbers;
    else if (!stands_for_no_number(cell))
      return false;
  }
  return numbers > 0 || filled == 0;
}

void check_range(const Sheet& sheet, std::size_t row, std::string_view column, double value) {
  if (const std::string why = outside_range(column, value); !why.empty())
    throw InputError(fmt::format("{}: {}", sheet.where(row, column), why));
}

std::string required_text(const Sheet& sheet, std::size_t row, std::string_view column) {
  sheet.require(column);
  const std::string& text = sheet.text(row, column);
  if (text.empty()) throw InputError(fmt::format("{}: must not be empty", sheet.where(row, column)));
  return text;
}

RunKind parse_kind(const Sheet& sheet, std::size_t row) {
  const std::string& text = sheet.text(row, "kind");
  if (text.empty() || text == "thrust") return RunKind::kThrust;
  if (text == "tare") return RunKind::kTare;
  throw InputError(fmt::format("{}: '{}' is neither thrust nor tare", sheet.where(row, "kind"), text));
}

/// Column indices by what they are, found once for all rows.
struct Columns {
  std::vector<std::size_t> numbers, labels;
};

Columns sort_columns(const Sheet& sheet) {
  Columns columns;
  for (std::size_t i = 0; i < sheet.columns.size(); ++i) {
    const std::string& name = sheet.columns[i];
    if (name.empty() || is_text_column(name)) continue;
    const bool known = known_column(name) != nullptr;
    (known || has_numbers(sheet, i) ? columns.numbers : columns.labels).push_back(i);
  }
  return columns;
}

void place(Run& run, const Sheet& sheet, const CampaignInfo& campaign) {
  run.y_norm = run.number("y_norm");
  run.z_norm = run.number("z_norm");
  if (run.y_norm.has_value() != run.z_norm.has_value()) {
    throw InputError::at(sheet.file, run.line,
                         "run {} has one of y_norm and z_norm; both or neither are required", run.run);
  }
  const auto point = grid_point(run.location);
  if (!run.y_norm && point && campaign.tunnel) {
    run.y_norm = point->y_norm;
    run.z_norm = point->z_norm;
  }
}

Run parse_run(const Sheet& sheet, std::size_t row, const Columns& columns, const CampaignInfo& campaign) {
  Run run;
  run.row = row;
  run.line = sheet.rows[row].line;
  run.run = required_text(sheet, row, "run");
  run.location = required_text(sheet, row, "location");
  run.session = required_text(sheet, row, "session");
  run.repeat = sheet.require_integer(row, "repeat", 0, std::numeric_limits<int>::max());
  run.kind = parse_kind(sheet, row);
  const std::string start = required_text(sheet, row, "start_utc");
  if (const auto seconds = parse_utc(start)) {
    run.start_s = *seconds;
  } else {
    throw InputError(fmt::format("{}: '{}' is not an ISO 8601 date and time (2026-03-02T08:00:00Z)",
                                 sheet.where(row, "start_utc"), start));
  }
  sheet.require("raw");
  run.raw = sheet.text(row, "raw");
  run.excluded = sheet.text(row, "excluded");
  run.note = sheet.text(row, "note");
  run.alarms = sheet.text(row, "alarms");
  for (const std::size_t i : columns.numbers) {
    const std::string& name = sheet.columns[i];
    if (const auto value = sheet.number(row, name)) {
      check_range(sheet, row, name, *value);
      run.numbers.emplace(name, *value);
    }
  }
  for (const std::size_t i : columns.labels) {
    const std::string& cell = sheet.rows[row].cells[i];
    if (!cell.empty()) run.labels.emplace(sheet.columns[i], cell);
  }
  for (int rotor = 0; rotor < kMaxRotors; ++rotor) {
    run.thrust_N[static_cast<std::size_t>(rotor)] = run.number(fmt::format("thrust_{}_N", rotor + 1));
  }
  place(run, sheet, campaign);
  return run;
}

/// "", "Z", "+05:30", "-0530", "+05" in minutes east; nothing for any other text.
std::optional<int> parse_zone(std::string_view text) {
  if (text.empty() || text == "Z" || text == "z") return 0;
  std::string digits(text.substr(1));
  if (digits.size() == 5 && digits[2] == ':') digits.erase(2, 1);
  const bool are_digits =
      std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  if ((text[0] != '+' && text[0] != '-') || (digits.size() != 2 && digits.size() != 4) || !are_digits)
    return {};
  digits.resize(4, '0');
  const int hour = std::stoi(digits.substr(0, 2)), minute = std::stoi(digits.substr(2));
  if (hour > 14 || minute > 59) return {};
  return (text[0] == '-' ? -1 : 1) * (60 * hour + minute);
}

void check_source(const Sheet& sheet, const Run& run, const CampaignInfo& campaign) {
  if (!run.raw.empty()) return;
  for (int rotor = 1; rotor <= campaign.rig.rotors; ++rotor) {
    if (!run.thrust_N[static_cast<std::size_t>(rotor - 1)]) {
      throw InputError::at(
          sheet.file, run.line,
          "run {} has no raw file, so thrust_1_N to thrust_{}_N are required; thrust_{}_N is empty", run.run,
          campaign.rig.rotors, rotor);
    }
  }
}

}  // namespace

bool is_text_column(std::string_view column) {
  return std::find(kText.begin(), kText.end(), column) != kText.end();
}

std::string_view known_but_for_case(std::string_view column) {
  const std::string lower = lower_case(column);
  const auto is_meant = [&](std::string_view known) { return known != column && lower_case(known) == lower; };
  for (const std::string_view known : kText)
    if (is_meant(known)) return known;
  for (const KnownColumn& known : kKnown)
    if (is_meant(known.name)) return known.name;
  return is_meant("source") ? "source" : std::string_view();
}

CampaignInfo at_speed(CampaignInfo campaign, std::optional<double> measured_rpm) {
  if (measured_rpm.value_or(0) > 0) campaign.rig.nominal_speed_rpm = *measured_rpm;
  return campaign;
}

std::optional<std::pair<double, double>> range_of(std::string_view column) {
  const KnownColumn* known = known_column(column);
  if (known == nullptr) return {};
  return std::pair(known->lowest, known->highest);
}

std::string outside_range(std::string_view column, double value) {
  const KnownColumn* known = known_column(column);
  if (known == nullptr || (value >= known->lowest && value <= known->highest)) return "";
  const std::string kelvin =
      column.ends_with("_C") && value < -273.15
          ? fmt::format(" ({:g} °C is {:g} K: below absolute zero)", value, value + 273.15)
          : "";
  return fmt::format("{:g} is outside {:g} to {:g}; {}{}", value, known->lowest, known->highest, known->hint,
                     kelvin);
}

std::optional<double> Run::number(std::string_view column) const {
  const auto found = numbers.find(column);
  if (found == numbers.end()) return {};
  return found->second;
}

std::vector<Run> parse_runs(const Sheet& sheet, const CampaignInfo& campaign) {
  for (const std::string_view column : {"run", "location", "repeat", "session", "start_utc", "raw"}) {
    sheet.require(column);
  }
  check_units(sheet);
  const Columns columns = sort_columns(sheet);
  std::vector<Run> runs;
  std::map<std::string, int> seen;
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    Run run = parse_run(sheet, row, columns, campaign);
    check_source(sheet, run, campaign);
    const auto [first, fresh] = seen.emplace(run.run, run.line);
    if (!fresh) {
      throw InputError::at(sheet.file, run.line, "run {} stands twice; it is also in line {}", run.run,
                           first->second);
    }
    runs.push_back(std::move(run));
  }
  return runs;
}

std::vector<CalibrationPoint> parse_calibration(const Sheet& sheet, int rotors) {
  for (const char* ours : {"applied_force_N", "voltage_V"}) require_in_our_unit(sheet, ours);
  std::vector<CalibrationPoint> points;
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    CalibrationPoint point;
    point.line = sheet.rows[row].line;
    point.cell = sheet.require_integer(row, "cell", 1, rotors);
    point.applied_force_N = sheet.require_number_within(row, "applied_force_N", kMostForce_N);
    point.voltage_V = sheet.require_number_within(row, "voltage_V", kMostReading);
    if (sheet.number(row, "sequence")) {
      point.sequence = sheet.require_integer(row, "sequence", 0, std::numeric_limits<int>::max());
    }
    point.direction = sheet.text(row, "direction");
    if (!point.direction.empty() && point.direction != "up" && point.direction != "down") {
      throw InputError(
          fmt::format("{}: '{}' is neither up nor down", sheet.where(row, "direction"), point.direction));
    }
    point.air_temperature_C = sheet.number(row, "air_temperature_C");
    if (point.air_temperature_C) check_range(sheet, row, "air_temperature_C", *point.air_temperature_C);
    points.push_back(point);
  }
  return points;
}

std::vector<PropellerTest> parse_propellers(const Sheet& sheet, int rotors) {
  require_in_our_unit(sheet, "thrust_N");
  std::vector<PropellerTest> tests;
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    PropellerTest test;
    test.line = sheet.rows[row].line;
    test.propeller = required_text(sheet, row, "propeller");
    test.rotor = sheet.require_integer(row, "rotor", 1, rotors);
    test.direction = required_text(sheet, row, "direction");
    if (test.direction != "CW" && test.direction != "CCW") {
      throw InputError(
          fmt::format("{}: '{}' is neither CW nor CCW", sheet.where(row, "direction"), test.direction));
    }
    test.thrust_N = sheet.require_number_within(row, "thrust_N", kMostForce_N);
    if (test.thrust_N <= 0) {
      throw InputError(fmt::format("{}: a propeller's thrust is above 0 N", sheet.where(row, "thrust_N")));
    }
    tests.push_back(test);
  }
  return tests;
}

std::optional<double> parse_utc(std::string_view text) {
  const std::string copy(text);
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, used = 0;
  if (std::sscanf(copy.c_str(), "%4d-%2d-%2d%*1[T ]%2d:%2d%n", &year, &month, &day, &hour, &minute, &used) !=
          5 ||
      used == 0 || month < 1 || month > 12 || day < 1 || day > 31 || hour < 0 || hour > 24 || minute < 0 ||
      minute > (hour == 24 ? 0 : 59)) {
    return {};
  }
  std::string_view rest = std::string_view(copy).substr(static_cast<std::size_t>(used));
  double second = 0;
  if (rest.starts_with(':')) {
    const auto end = std::min(rest.find_first_not_of("0123456789.", 1), rest.size());
    const auto parsed = parse_number(rest.substr(1, end - 1));
    if (!parsed || *parsed < 0 || *parsed >= 61 || (hour == 24 && *parsed > 0)) return {};
    second = *parsed;
    rest.remove_prefix(end);
  }
  const std::optional<int> zone_minutes = parse_zone(rest);
  if (!zone_minutes) return {};
  std::tm calendar{};
  calendar.tm_year = year - 1900;
  calendar.tm_mon = month - 1;
  calendar.tm_mday = day;
  calendar.tm_hour = hour;
  calendar.tm_min = minute;
  const std::time_t seconds = ::timegm(&calendar);  // counts on: the 30th of February is the 2nd of March
  if (hour < 24 && (calendar.tm_mon != month - 1 || calendar.tm_mday != day)) return {};
  return static_cast<double>(seconds) + second - 60.0 * *zone_minutes;
}

std::string format_utc(double seconds) {
  const auto milliseconds = static_cast<long long>(std::llround(seconds * 1000));
  const auto whole =
      static_cast<std::time_t>(milliseconds >= 0 ? milliseconds / 1000 : (milliseconds - 999) / 1000);
  const auto fraction = static_cast<int>(milliseconds - static_cast<long long>(whole) * 1000);
  std::tm calendar{};
  ::gmtime_r(&whole, &calendar);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &calendar);
  return fraction == 0 ? fmt::format("{}Z", text.data()) : fmt::format("{}.{:03}Z", text.data(), fraction);
}

double utc_seconds() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace tunnelrig
