#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// The reading remembers where it came from: F (1 + h sign(F_prev - F)), F_prev the load of the run before.
Effect hysteresis(Random& random) {
  return {.name = "hysteresis",
          .covariates = {"run_order"},
          .change =
              [](const Place& at, double h) {
                // the first run of a campaign comes from no load
                const double before_N = at.run == 0 ? 0 : at.world.baseline_N[at.run - 1][at.rotor];
                return before_N > at.baseline_N() ? h : -h;
              },
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
