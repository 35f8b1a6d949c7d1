#include "attribution/effects/catalogue.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::attribution {

// Made up: something in the supply oscillates in a band of its voltage and costs thrust there.
Effect voltage_band(Random& random) {
  const double centre_V = random.uniform(14.75, 14.95);
  return {.name = "voltage_band",
          .in_library = false,
          .covariates = {"supply_voltage_V"},
          .fixed = {{"centre", "V", centre_V}},
          .change = [centre_V](const Place& at, double size) {
            return std::abs(at.conditions().supply_voltage_V - centre_V) < 0.12 ? -size : 0;
          }};
}

}  // namespace tunnelrig::attribution
