#include "datasets/units.h"

#include "datasets/error.h"
#include "datasets/unit_list.h"

#include <algorithm>
#include <array>
#include <numbers>

namespace tunnelrig {
namespace {

constexpr double kGravity = 9.80665;   // m/s², standard
constexpr double kPound = 0.45359237;  // kg
constexpr double kPi = std::numbers::pi;

constexpr std::array<Unit, 100> kUnits = {{
    {"1", "number", 1, 0},
    {"", "number", 1, 0},
    {kTextUnit, "text", 1, 0},
    {"days", "date", 1, 0},
    {kDateUnit, "date", 1, 0},
    {"%", "number", 0.01, 0},
    {"N", "force", 1, 0},
    {"mN", "force", 1e-3, 0},
    {"kN", "force", 1e3, 0},
    {"gf", "force", kGravity * 1e-3, 0},
    {"g", "force", kGravity * 1e-3, 0},
    {"kgf", "force", kGravity, 0},
    {"kg", "force", kGravity, 0},
    {"lbf", "force", kPound* kGravity, 0},
    {"ozf", "force", kPound* kGravity / 16, 0},
    {"rpm", "speed", 1, 0},
    {"RPM", "speed", 1, 0},
    {"rev/min", "speed", 1, 0},
    {"rev/s", "speed", 60, 0},
    {"rps", "speed", 60, 0},
    {"rad/s", "speed", 30 / kPi, 0},
    {"m", "length", 1, 0},
    {"cm", "length", 1e-2, 0},
    {"mm", "length", 1e-3, 0},
    {"in", "length", 0.0254, 0},
    {"ft", "length", 0.3048, 0},
    {"m2", "area", 1, 0},
    {"m²", "area", 1, 0},
    {"cm2", "area", 1e-4, 0},
    {"cm²", "area", 1e-4, 0},
    {"°C", "temperature", 1, 0},
    {"degC", "temperature", 1, 0},
    {"C", "temperature", 1, 0},
    {"ºC", "temperature", 1, 0},
    {"K", "temperature", 1, -273.15},
    {"degF", "temperature", 5.0 / 9, -160.0 / 9},
    {"°F", "temperature", 5.0 / 9, -160.0 / 9},
    {"Pa", "pressure", 1, 0},
    {"hPa", "pressure", 100, 0},
    {"mbar", "pressure", 100, 0},
    {"kPa", "pressure", 1000, 0},
    {"bar", "pressure", 1e5, 0},
    {"atm", "pressure", 101325, 0},
    {"mmHg", "pressure", 133.322387415, 0},
    {"Torr", "pressure", 101325.0 / 760, 0},
    {"psi", "pressure", 6894.757293168, 0},
    {"inHg", "pressure", 3386.389, 0},
    {"kg/m3", "density", 1, 0},
    {"kg/m³", "density", 1, 0},
    {"V", "voltage", 1, 0},
    {"mV", "voltage", 1e-3, 0},
    {"uV", "voltage", 1e-6, 0},
    {"µV", "voltage", 1e-6, 0},
    {"μV", "voltage", 1e-6, 0},
    {"V/V", "voltage ratio", 1, 0},
    {"mV/V", "voltage ratio", 1e-3, 0},
    {"uV/V", "voltage ratio", 1e-6, 0},
    {"µV/V", "voltage ratio", 1e-6, 0},
    {"μV/V", "voltage ratio", 1e-6, 0},  // the Greek letter, where that above is the micro sign
    {"counts", "number", 1, 0},
    {"A", "current", 1, 0},
    {"mA", "current", 1e-3, 0},
    {"W", "power", 1, 0},
    {"mW", "power", 1e-3, 0},
    {"kW", "power", 1e3, 0},
    {"MW", "power", 1e6, 0},
    {"s", "time", 1, 0},
    {"ms", "time", 1e-3, 0},
    {"us", "time", 1e-6, 0},
    {"µs", "time", 1e-6, 0},
    {"μs", "time", 1e-6, 0},
    {"min", "time", 60, 0},
    {"h", "time", 3600, 0},
    {"d", "time", 86400, 0},
    {"Hz", "frequency", 1, 0},
    {"kHz", "frequency", 1e3, 0},
    {"m/s", "velocity", 1, 0},
    {"kt", "velocity", 1852.0 / 3600, 0},
    {"km/h", "velocity", 1 / 3.6, 0},
    {"mph", "velocity", 0.44704, 0},
    {"cm/s", "velocity", 1e-2, 0},
    {"ft/s", "velocity", 0.3048, 0},
    {"rad", "angle", 1, 0},
    {"deg", "angle", kPi / 180, 0},
    {"°", "angle", kPi / 180, 0},
    {"N·m", "torque", 1, 0},
    {"N m", "torque", 1, 0},
    {"N*m", "torque", 1, 0},
    {"Nm", "torque", 1, 0},
    {"mN·m", "torque", 1e-3, 0},
    {"mN m", "torque", 1e-3, 0},
    {"mNm", "torque", 1e-3, 0},
    {"ozf·in", "torque", kPound* kGravity / 16 * 0.0254, 0},
    {"lbf·in", "torque", kPound* kGravity * 0.0254, 0},
    {"lbf·ft", "torque", kPound* kGravity * 0.3048, 0},
    {"gf·cm", "torque", kGravity * 1e-5, 0},
    {"kgf·cm", "torque", kGravity * 1e-2, 0},
    {"kgf·m", "torque", kGravity, 0},
    {"N/W", "efficiency", 1, 0},
    {"gf/W", "efficiency", kGravity * 1e-3, 0},
}};

struct Suffix {
  std::string_view end, unit;
};

/// Of docs/campaign-folder.md; the longer before what they end in.
constexpr std::array<Suffix, 25> kSuffixes = {
    {{"_rpm", "rpm"}, {"_rad_s", "rad/s"}, {"_cm_s", "cm/s"}, {"_m_s", "m/s"}, {"_km_h", "km/h"},
     {"_N_m", "N·m"}, {"_Nm", "N·m"},      {"_mm", "mm"},     {"_cm", "cm"},   {"_m", "m"},
     {"_C", "°C"},    {"_K", "K"},         {"_F", "°F"},      {"_Pa", "Pa"},   {"_hPa", "hPa"},
     {"_kPa", "kPa"}, {"_N", "N"},         {"_gf", "gf"},     {"_V", "V"},     {"_mV", "mV"},
     {"_A", "A"},     {"_W", "W"},         {"_deg", "deg"},   {"_Hz", "Hz"},   {"_percent", "%"}}};

}  // namespace

std::span<const Unit> known_units() { return kUnits; }

const Unit& unit_from_name(std::string_view name) {
  const auto* found =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& unit) { return unit.name == name; });
  if (found != kUnits.end()) return *found;
  std::vector<std::string_view> names;
  names.reserve(kUnits.size());
  for (const Unit& unit : kUnits)
    if (!unit.name.empty()) names.push_back(unit.name);
  throw InputError(fmt::format("'{}' is not a known unit; write 1 for a number of any other; known are {}",
                               name, fmt::join(names, " ")));
}

std::string_view unit_after_conversion(std::string_view name) {
  const Unit& unit = unit_from_name(name);
  if (unit.quantity == "voltage ratio") return "1";
  return std::find_if(kUnits.begin(), kUnits.end(),
                      [&](const Unit& other) {
                        return other.quantity == unit.quantity && other.factor == 1 && other.offset == 0;
                      })
      ->name;
}

std::string_view unit_in_ending(std::string_view column) {
  const auto* found = std::find_if(kSuffixes.begin(), kSuffixes.end(),
                                   [&](const Suffix& suffix) { return column.ends_with(suffix.end); });
  return found == kSuffixes.end() ? std::string_view() : found->unit;
}

std::string_view unit_in_header(std::string_view header) {
  const auto open = header.rfind('(');
  if (open == std::string_view::npos || !header.ends_with(')')) return {};
  return header.substr(open + 1, header.size() - open - 2);
}

}  // namespace tunnelrig
