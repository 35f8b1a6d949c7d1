#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {

// Made up: one rotor of which thrust bends away below and above a temperature of its own.
Effect temperature_kink(Random& random) {
  const double corner_C = random.uniform(19.5, 21.5);
  return {.name = "temperature_kink",
          .in_library = false,
          .covariates = {"air_temperature_C"},
          .rotor = random.below(kRotors),
          .fixed = {{"corner", "C", corner_C}},
          .change =
              [corner_C](const Place& at, double size) {
                return size * std::abs(at.conditions().air_temperature_C - corner_C);
              },
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
