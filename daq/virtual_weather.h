// Several days of weather for the virtual rig: smooth, plausible, and a function of time alone.
#pragma once

#include <cstdint>

namespace tunnelrig {

struct Weather {
  double air_temperature_C = 20;
  double air_pressure_Pa = 101325;
  double relative_humidity = 0.5;
};

/// Weather in the laboratory at `time_s` (seconds since 1970): fronts that pass in two to nine days (σ of the
/// pressure 450 Pa about 101325 Pa), and a daily course of temperature and humidity.
Weather weather_at(double time_s, std::uint64_t seed);

/// Density of moist air, kg/m³, by the ideal-gas law with Tetens' saturation pressure.
double true_air_density(const Weather& weather);

}  // namespace tunnelrig
