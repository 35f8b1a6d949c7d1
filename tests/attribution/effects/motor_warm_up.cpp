#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// A cold motor gives more: T (1 + a e^(-t / tau)), t since motor start, a > 0.
Effect motor_warm_up(Random& random) {
  const double tau_s = random.log_uniform(50, 250);
  return {.name = "motor_warm_up",
          .covariates = {"time_since_motor_start_s"},
          .fixed = {{"tau", "s", tau_s}},
          .change = [tau_s](const Place& at, double a) {
            return a * std::exp(-at.time_since_start_s() / tau_s);
          }};
}

}  // namespace tunnelrig::attribution
