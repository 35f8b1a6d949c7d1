// Properties of air. Temperatures in kelvin, SI throughout.
#pragma once

namespace tunnelrig {

/// Density of dry air, ρ = p/(λΘ) with λ = 287.058 J/(kg K) (4.17), kg/m³.
double dry_air_density_kg_m3(double pressure_Pa, double temperature_K);

/// Density of moist air by the ideal-gas law, kg/m³: vapour displaces dry air of the same pressure.
/// Saturation pressure of water by Buck (1981), within 0.1 % from 0 to 50 °C.
double moist_air_density_kg_m3(double pressure_Pa, double temperature_K, double relative_humidity);

double saturation_pressure_Pa(double temperature_K);

/// Dynamic viscosity by Sutherland's law, Pa s (White, Viscous Fluid Flow, eq. 1-36).
double air_viscosity_Pa_s(double temperature_K);

/// Speed of sound in dry air, m/s.
double speed_of_sound_m_s(double temperature_K);

inline constexpr double kZeroCelsius_K = 273.15;

}  // namespace tunnelrig
