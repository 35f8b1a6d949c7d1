#include "daq/virtual_weather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace tunnelrig {
namespace {

constexpr double kDay_s = 86400;
constexpr double kFullTurn = 2 * std::numbers::pi;

/// A sum of slow waves with random phases, of standard deviation 1.
double fronts(double time_s, std::mt19937_64& engine) {
  constexpr std::array<double, 4> kPeriods_day = {2.3, 3.7, 5.9, 9.1};
  std::uniform_real_distribution<double> phase(0, kFullTurn);
  double sum = 0;
  for (const double period : kPeriods_day)
    sum += std::sin(kFullTurn * time_s / (period * kDay_s) + phase(engine));
  return sum / std::sqrt(kPeriods_day.size() / 2.0);
}

}  // namespace

Weather weather_at(double time_s, std::uint64_t seed) {
  std::mt19937_64 engine(seed ^ 0x77656174686572u);
  const double warmest_s = 15 * 3600;
  const double day = std::cos(kFullTurn * (time_s - warmest_s) / kDay_s);
  Weather weather;
  weather.air_pressure_Pa = 101325 + 450 * fronts(time_s, engine);
  weather.air_temperature_C = 21 + 2.5 * day + 1.8 * fronts(time_s, engine);
  weather.relative_humidity = std::clamp(0.5 - 0.10 * day + 0.08 * fronts(time_s, engine), 0.05, 0.95);
  return weather;
}

double true_air_density(const Weather& weather) {
  constexpr double kDry_J_kgK = 287.05, kVapour_J_kgK = 461.5;
  const double kelvin = weather.air_temperature_C + 273.15;
  const double saturation_Pa =
      610.78 * std::exp(17.27 * weather.air_temperature_C / (weather.air_temperature_C + 237.3));
  const double vapour_Pa = weather.relative_humidity * saturation_Pa;
  return (weather.air_pressure_Pa - vapour_Pa) / (kDry_J_kgK * kelvin) + vapour_Pa / (kVapour_J_kgK * kelvin);
}

}  // namespace tunnelrig
