#include "attribution/effects/catalogue.h"

#include "datasets/error.h"

#include <array>
#include <utility>

namespace tunnelrig::attribution {
namespace {

constexpr std::array<std::pair<std::string_view, Effect (*)(Random&)>, 31> kEffects = {{
    {"adc_clipping", adc_clipping},
    {"air_humidity", air_humidity},
    {"air_pressure", air_pressure},
    {"axial_wind", axial_wind},
    {"blade_sets", blade_sets},
    {"cable_wave", cable_wave},
    {"ceiling_effect", ceiling_effect},
    {"creep", creep},
    {"crosstalk", crosstalk},
    {"fan_switch", fan_switch},
    {"ground_effect", ground_effect},
    {"humidity_wave", humidity_wave},
    {"hysteresis", hysteresis},
    {"mains_pickup", mains_pickup},
    {"motor_warm_up", motor_warm_up},
    {"mounting_step", mounting_step},
    {"nonlinearity", nonlinearity},
    {"propeller_step", propeller_step},
    {"reynolds_number", reynolds_number},
    {"rotor_speed", rotor_speed},
    {"span_drift_temperature", span_drift_temperature},
    {"supply_voltage", supply_voltage},
    {"temperature_gradient", temperature_gradient},
    {"temperature_kink", temperature_kink},
    {"time_of_day_arch", time_of_day_arch},
    {"tip_mach", tip_mach},
    {"vibration_alias", vibration_alias},
    {"voltage_band", voltage_band},
    {"wake_recirculation", wake_recirculation},
    {"zero_drift_temperature", zero_drift_temperature},
    {"zero_drift_time", zero_drift_time},
}};

}  // namespace

Effect make_effect(std::string_view name, Random& random) {
  for (const auto& [known, make] : kEffects) {
    if (known == name) return make(random);
  }
  throw InputError(fmt::format("--effect {}: there is no such true effect (--list shows them)", name));
}

std::vector<std::string> effect_names() {
  std::vector<std::string> names;
  names.reserve(kEffects.size());
  for (const auto& entry : kEffects) names.emplace_back(entry.first);
  return names;
}

}  // namespace tunnelrig::attribution
