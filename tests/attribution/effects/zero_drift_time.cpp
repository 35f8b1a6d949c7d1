#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// The zero creeps away through a session: an offset per hour since its first run.
Effect zero_drift_time(Random& random) {
  return {.name = "zero_drift_time",
          .covariates = {"start_utc"},
          .change = [](const Place& at,
                       double n_per_h) { return n_per_h * at.conditions().session_time_h / at.baseline_N(); },
          .amplitude_unit = "N/h",
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
