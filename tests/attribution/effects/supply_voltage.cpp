#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// The speed controllers give way a little as the supply sags: T (V / V0)^n.
Effect supply_voltage(Random& /*random*/) {
  return {.name = "supply_voltage",
          .covariates = {"supply_voltage_V"},
          .change = [](const Place& at,
                       double n) { return std::pow(at.conditions().supply_voltage_V / 15.0, n) - 1; },
          .amplitude_name = "exponent"};
}

}  // namespace tunnelrig::attribution
