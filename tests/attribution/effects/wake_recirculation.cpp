#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// The tunnel takes time to fill with the rotors' own wake: T (1 + b (1 - e^(-t / tau))) at tunnel locations
// only.
Effect wake_recirculation(Random& random) {
  const double tau_s = random.log_uniform(50, 250);
  return {.name = "wake_recirculation",
          .covariates = {"time_since_motor_start_s"},
          .fixed = {{"tau", "s", tau_s}},
          .change =
              [tau_s](const Place& at, double b) {
                return at.conditions().in_tunnel ? b * -std::expm1(-at.time_since_start_s() / tau_s) : 0;
              },
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
