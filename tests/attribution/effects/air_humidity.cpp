#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// Water vapour is lighter than air: rho = p / (lambda Theta) (1 - 0.378 e / p), vapour pressure e by Magnus.
Effect air_humidity(Random& /*random*/) {
  return {.name = "air_humidity",
          .covariates = {"relative_humidity", "air_temperature_C", "air_pressure_Pa"},
          .change =
              [](const Place& at, double coefficient) {
                const Conditions& run = at.conditions();
                const double saturation_Pa =
                    610.94 * std::exp(17.625 * run.air_temperature_C / (run.air_temperature_C + 243.04));
                return -coefficient * 0.378 * run.relative_humidity * saturation_Pa / run.air_pressure_Pa;
              },
          .scale_covariate =
              [](Conditions& run, double factor) {
                run.relative_humidity = std::clamp(0.5 + factor * (run.relative_humidity - 0.5), 0.04, 0.96);
              }};
}

}  // namespace tunnelrig::attribution
