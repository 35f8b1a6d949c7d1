#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// Compressibility at the tip: C_T goes with (1 - M^2)^-n, M = Omega R over the speed of sound.
Effect tip_mach(Random& /*random*/) {
  return {.name = "tip_mach",
          .covariates = {"air_temperature_C", "speed_rpm"},
          .change = [](const Place& at, double n) {
            const Conditions& run = at.conditions();
            const double sound_m_s = std::sqrt(1.4 * kGasConstant_J_kgK * (run.air_temperature_C + 273.15));
            const double mach = run.speed_rpm / 60 * 2 * 3.14159265358979 * kRadius_m / sound_m_s;
            return std::pow((1 - mach * mach) / (1 - 0.2325 * 0.2325), -n) - 1;
          }};
}

}  // namespace tunnelrig::attribution
