#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// A cell is mounted anew between two sessions: its zero is another from then on.
Effect mounting_step(Random& random) {
  const double fraction = random.uniform(0.3, 0.7);
  return {.name = "mounting_step",
          .covariates = {"session"},
          .rotor = random.below(kRotors),
          .fixed = {{"at_fraction_of_sessions", "1", fraction}},
          .change =
              [fraction](const Place& at, double offset_N) {
                const double first = std::round(fraction * at.world.blocks);
                return at.conditions().session >= first ? offset_N / at.baseline_N() : 0;
              },
          .amplitude_unit = "N",
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
