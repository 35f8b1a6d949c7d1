#include "datasets/meanings.h"

#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace tunnelrig {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// The quantity that a column's unit must be of, and from where to where its values can lie.
struct Meaning {
  std::string_view name, quantity;
  double lowest = -kNoLimit, highest = kNoLimit;
  std::string_view otherwise = {};  // what a value beyond is
};

constexpr std::string_view kNoDistance = "no distance from a wall: a distance is not negative";
constexpr std::string_view kNoAmplitude = "no amplitude: an amplitude is not negative";
constexpr double kLowest_Pa = 20e3, kHighest_Pa = 120e3;

constexpr std::array<Meaning, 26> kMeanings = {
    {{"thrust_N", "force"},
     {"c_t", "number"},
     {"c_t_helicopter", "number"},
     {"c_t_propeller", "number"},
     {"speed_rpm", "speed", 0, kNoLimit,
      "no rotor speed: a speed is not negative, its direction is the sign of the thrust"},
     {"air_temperature_C", "temperature", -80, 80,
      "no temperature of air; degrees Celsius, kelvin or Fahrenheit?"},
     {"air_pressure_Pa", "pressure", kLowest_Pa, kHighest_Pa,
      "no absolute pressure of air, which is from 20 to 120 kPa; Pa, hPa or kPa?"},
     {"relative_humidity", "number", 0, 1.05,
      "no relative humidity, which is from 0 to 1, or from 0 to 100 %"},
     {"supply_voltage_V", "voltage", 0, kNoLimit, "no supply voltage: it is not negative"},
     {"tunnel_airspeed_m_s", "velocity"},
     {"cell_temperature_C", "temperature", -80, 200,
      "no temperature of a cell; degrees Celsius, kelvin or Fahrenheit?"},
     {"time_since_motor_start_s", "time"},
     {"propeller_diameter_m", "length", 0, kNoLimit, "no diameter: a diameter is not negative"},
     {"ground_distance_R", "number", 0, kNoLimit, kNoDistance},
     {"ceiling_distance_R", "number", 0, kNoLimit, kNoDistance},
     {"wall_distance_R", "number", 0, kNoLimit, kNoDistance},
     {"excitation_voltage_V", "voltage", 0, kNoLimit, "no excitation: it is not negative"},
     {"adc_reference_V", "voltage", 0, kNoLimit, "no reference of a converter: it is not negative"},
     {"clip_fraction", "number", 0, 1, "no share of samples, which is from 0 to 1, or from 0 to 100 %"},
     {"mains_amplitude_V", "voltage", 0, kNoLimit, kNoAmplitude},
     {"alias_amplitude_V", "voltage", 0, kNoLimit, kNoAmplitude},
     {"vibration_amplitude_V", "voltage", 0, kNoLimit, kNoAmplitude},
     {"cable_force_N", "force"},
     {"tilt_deg", "angle"},
     {"hours_in_session", "time"},
     {"run_order", "number"}}};

const Meaning* find_meaning(std::string_view name) {
  const auto* const found =
      std::find_if(kMeanings.begin(), kMeanings.end(), [&](const Meaning& m) { return m.name == name; });
  return found == kMeanings.end() ? nullptr : found;
}

}  // namespace

void check_meaning(std::string_view meaning, const Unit& unit) {
  if (meaning.empty()) return;
  if (const Meaning* known = find_meaning(meaning)) {
    if (known->quantity == unit.quantity) return;
    throw InputError(fmt::format("{} is a {}, and '{}' is a unit of {}", meaning, known->quantity, unit.name,
                                 unit.quantity));
  }
  std::vector<std::string_view> names;
  for (const Meaning& known : kMeanings) names.push_back(known.name);
  throw InputError(fmt::format("'{}' is no known meaning; known are {}", meaning, fmt::join(names, " ")));
}

std::optional<std::string> impossible(double value, const Unit& unit, std::string_view meaning) {
  if (unit.quantity == "temperature" && value < -273.15) return "below absolute zero";
  const Meaning* known = find_meaning(meaning);
  if (known == nullptr || (value >= known->lowest && value <= known->highest)) return {};
  return std::string(known->otherwise);
}

}  // namespace tunnelrig
