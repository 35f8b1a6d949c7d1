#include "datasets/run_columns.h"

#include "datasets/lower_case.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace tunnelrig {
namespace {

/// A quantity by its name without the unit, and how other units of it end, in small letters.
struct Quantity {
  std::string_view name, ours;
  std::vector<std::string_view> others;
};

const std::vector<Quantity>& quantities() {
  static const std::vector<std::string_view> kTemperatures = {"k", "f", "degc", "degf", "kelvin"};
  static const std::vector<std::string_view> kVoltages = {"mv", "kv", "uv"};
  static const std::vector<std::string_view> kLengths = {"m", "cm", "mm", "in", "ft"};
  static const std::vector<std::string_view> kForces = {"gf", "g", "kgf", "kg", "mn", "kn", "lbf", "ozf"};
  static const std::vector<Quantity> kQuantities = {
      {"ground_distance", "ground_distance_R", kLengths},
      {"ceiling_distance", "ceiling_distance_R", kLengths},
      {"wall_distance", "wall_distance_R", kLengths},
      {"speed", "speed_rpm", {"rad_s", "hz", "rps", "rev_s", "krpm"}},
      {"air_temperature", "air_temperature_C", kTemperatures},
      {"cell_temperature", "cell_temperature_C", kTemperatures},
      {"air_pressure",
       "air_pressure_Pa",
       {"hpa", "kpa", "mbar", "bar", "mmhg", "inhg", "torr", "psi", "atm"}},
      {"relative_humidity", "relative_humidity", {"percent", "pct"}},
      {"supply_voltage", "supply_voltage_V", kVoltages},
      {"excitation_voltage", "excitation_voltage_V", kVoltages},
      {"tunnel_airspeed", "tunnel_airspeed_m_s", {"km_h", "cm_s", "mm_s", "kt", "kn", "mph", "ft_s"}},
      {"time_since_motor_start", "time_since_motor_start_s", {"ms", "min", "h"}},
      {"tilt", "tilt_deg", {"rad", "mrad"}},
      {"thrust_1", "thrust_1_N", kForces},
      {"thrust_2", "thrust_2_N", kForces},
      {"thrust_3", "thrust_3_N", kForces},
      {"thrust_4", "thrust_4_N", kForces},
  };
  return kQuantities;
}

}  // namespace

bool stands_for_no_number(std::string_view cell) {
  constexpr std::array<std::string_view, 7> kNone = {"nan", "na", "n/a", "#n/a", "null", "inf", "-inf"};
  return std::ranges::count(kNone, lower_case(cell)) > 0;
}

bool is_made_of_times(std::string_view column) {
  constexpr std::array<std::string_view, 3> kMade = {"run_order", "hours_in_session", "hour_of_day"};
  return std::ranges::count(kMade, column) > 0;
}

std::string_view in_our_unit(std::string_view column) {
  for (const Quantity& quantity : quantities()) {
    if (column == quantity.ours || !column.starts_with(quantity.name)) continue;
    std::string_view ending = column.substr(quantity.name.size());
    if (ending.empty()) return quantity.ours;
    if (ending.front() != '_') continue;
    ending.remove_prefix(1);
    if (std::ranges::count(quantity.others, lower_case(ending)) > 0) return quantity.ours;
  }
  return {};
}

}  // namespace tunnelrig
