#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// A cell reads a little of its neighbour on the same side.
Effect crosstalk(Random& random) {
  return {.name = "crosstalk",
          .change =
              [](const Place& at, double share) {
                return share * at.world.baseline_N[at.run][at.rotor ^ 1U] / at.baseline_N();
              },
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
