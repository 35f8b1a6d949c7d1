#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// The cell's line is bent: F (1 + q (F - F0)).
Effect nonlinearity(Random& random) {
  return {.name = "nonlinearity",
          .change = [](const Place& at, double per_N) { return per_N * (at.baseline_N() - 7.36); },
          .amplitude_unit = "1/N",
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
