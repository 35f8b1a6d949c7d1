#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// The bridge's zero moves with the cell's own temperature: an offset, whatever the load.
Effect zero_drift_temperature(Random& random) {
  return {.name = "zero_drift_temperature",
          .covariates = {"cell_temperature_C"},
          .change =
              [](const Place& at, double n_per_K) {
                return n_per_K * (at.conditions().cell_temperature_C - 22) / at.baseline_N();
              },
          .amplitude_unit = "N/K",
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
