// Every true effect that a campaign can be told to have. One file each, named like the effect.
#pragma once

#include "attribution/effects/effect.h"

#include <string_view>

namespace tunnelrig::attribution {

// Names of the list. `random` draws time constants, the sign where physics leaves it open, and the
// rotor.
Effect air_humidity(Random& random);
Effect air_pressure(Random& random);
Effect axial_wind(Random& random);
Effect ceiling_effect(Random& random);
Effect creep(Random& random);
Effect crosstalk(Random& random);
Effect ground_effect(Random& random);
Effect hysteresis(Random& random);
Effect motor_warm_up(Random& random);
Effect mounting_step(Random& random);
Effect nonlinearity(Random& random);
Effect propeller_step(Random& random);
Effect reynolds_number(Random& random);
Effect rotor_speed(Random& random);
Effect span_drift_temperature(Random& random);
Effect supply_voltage(Random& random);
Effect temperature_gradient(Random& random);
Effect tip_mach(Random& random);
Effect wake_recirculation(Random& random);
Effect zero_drift_temperature(Random& random);
Effect zero_drift_time(Random& random);

// Seen in spectra of raw campaigns.
Effect adc_clipping(Random& random);
Effect mains_pickup(Random& random);
Effect vibration_alias(Random& random);

// Made up: no name in anybody's list fits them.
Effect blade_sets(Random& random);
Effect cable_wave(Random& random);
Effect fan_switch(Random& random);
Effect humidity_wave(Random& random);
Effect temperature_kink(Random& random);
Effect time_of_day_arch(Random& random);
Effect voltage_band(Random& random);

/// The effect of a name. Throws InputError naming it where there is none.
Effect make_effect(std::string_view name, Random& random);

std::vector<std::string> effect_names();

}  // namespace tunnelrig::attribution
