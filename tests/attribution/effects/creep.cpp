#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// The cell yields under load: F (1 + c (1 - e^(-t / tau))), c > 0, t since the load came on.
Effect creep(Random& random) {
  const double tau_s = random.log_uniform(50, 250);
  return {.name = "creep",
          .covariates = {"time_since_motor_start_s"},
          .fixed = {{"tau", "s", tau_s}},
          .change = [tau_s](const Place& at, double c) {
            return c * -std::expm1(-at.time_since_start_s() / tau_s);
          }};
}

}  // namespace tunnelrig::attribution
