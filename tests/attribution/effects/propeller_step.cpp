#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// A propeller is knocked or changed between two sessions: its rotor's thrust has another factor from then on.
Effect propeller_step(Random& random) {
  const double fraction = random.uniform(0.3, 0.7);
  return {.name = "propeller_step",
          .covariates = {"session"},
          .rotor = random.below(kRotors),
          .fixed = {{"at_fraction_of_sessions", "1", fraction}},
          .change =
              [fraction](const Place& at, double gain) {
                const double first = std::round(fraction * at.world.blocks);
                return at.conditions().session >= first ? gain : 0;
              },
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
