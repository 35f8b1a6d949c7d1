#include "analysis/air.h"

#include "datasets/thesis.h"

#include <cmath>

namespace tunnelrig {
namespace {

constexpr double kVapourRatio = 0.62198;  // molar mass of water over that of dry air
constexpr double kHeatCapacityRatio = 1.4;

}  // namespace

double dry_air_density_kg_m3(double pressure_Pa, double temperature_K) {
  return pressure_Pa / (thesis::kGasConstant_J_kgK * temperature_K);
}

double saturation_pressure_Pa(double temperature_K) {
  const double celsius = temperature_K - kZeroCelsius_K;
  return 611.21 * std::exp((18.678 - celsius / 234.5) * celsius / (257.14 + celsius));
}

double moist_air_density_kg_m3(double pressure_Pa, double temperature_K, double relative_humidity) {
  const double vapour_Pa = relative_humidity * saturation_pressure_Pa(temperature_K);
  return dry_air_density_kg_m3(pressure_Pa - (1 - kVapourRatio) * vapour_Pa, temperature_K);
}

double air_viscosity_Pa_s(double temperature_K) {
  constexpr double kReference_Pa_s = 1.716e-5, kReference_K = 273.15, kSutherland_K = 110.4;
  return kReference_Pa_s * std::pow(temperature_K / kReference_K, 1.5) * (kReference_K + kSutherland_K) /
         (temperature_K + kSutherland_K);
}

double speed_of_sound_m_s(double temperature_K) {
  return std::sqrt(kHeatCapacityRatio * thesis::kGasConstant_J_kgK * temperature_K);
}

}  // namespace tunnelrig
