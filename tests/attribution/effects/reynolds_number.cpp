#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// C_T goes with (Re / Re0)^m; Re = rho Omega R c / mu, viscosity by Sutherland.
Effect reynolds_number(Random& random) {
  const auto reynolds = [](const Conditions& run) {
    const double theta_K = run.air_temperature_C + 273.15;
    const double viscosity_Pa_s =
        1.716e-5 * std::pow(theta_K / 273.15, 1.5) * (273.15 + 110.4) / (theta_K + 110.4);
    const double density_kg_m3 = run.air_pressure_Pa / (kGasConstant_J_kgK * theta_K);
    return density_kg_m3 * run.speed_rpm / 60 * 2 * 3.14159265358979 * kRadius_m * kChord_m / viscosity_Pa_s;
  };
  Conditions standard;
  return {.name = "reynolds_number",
          .covariates = {"air_temperature_C", "speed_rpm", "air_pressure_Pa"},
          .change = [reynolds, reference = reynolds(standard)](
                        const Place& at,
                        double m) { return std::pow(reynolds(at.conditions()) / reference, m) - 1; },
          .sign = random.chance(0.8) ? 1.0 : -1.0,
          .amplitude_name = "exponent"};
}

}  // namespace tunnelrig::attribution
