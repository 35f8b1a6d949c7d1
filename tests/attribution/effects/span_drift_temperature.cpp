#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// The bridge's sensitivity moves with the cell's own temperature: a gain.
Effect span_drift_temperature(Random& random) {
  return {.name = "span_drift_temperature",
          .covariates = {"cell_temperature_C"},
          .change = [](const Place& at,
                       double per_K) { return per_K * (at.conditions().cell_temperature_C - 22); },
          .amplitude_unit = "1/K",
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
