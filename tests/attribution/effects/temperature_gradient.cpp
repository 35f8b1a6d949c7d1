#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// A cell warmer than the air around it has a gradient along its beam, which bends the zero.
Effect temperature_gradient(Random& random) {
  return {.name = "temperature_gradient",
          .covariates = {"cell_temperature_C", "air_temperature_C"},
          .change =
              [](const Place& at, double n_per_K) {
                const Conditions& run = at.conditions();
                return n_per_K * (run.cell_temperature_C - run.air_temperature_C) / at.baseline_N();
              },
          .amplitude_unit = "N/K",
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
