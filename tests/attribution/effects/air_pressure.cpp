#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// Thrust is proportional to density, and density to pressure; the baseline holds 101325 Pa.
Effect air_pressure(Random& /*random*/) {
  return {.name = "air_pressure",
          .covariates = {"air_pressure_Pa"},
          .change =
              [](const Place& at, double exponent) {
                return std::pow(at.conditions().air_pressure_Pa / kStandardPressure_Pa, exponent) - 1;
              },
          .amplitude_name = "exponent",
          .scale_covariate =
              [](Conditions& run, double factor) {
                run.air_pressure_Pa =
                    std::clamp(kStandardPressure_Pa + factor * (run.air_pressure_Pa - kStandardPressure_Pa),
                               90000.0, 112000.0);
              }};
}

}  // namespace tunnelrig::attribution
