#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// Made up: a fan of the room that somebody switches and writes down.
Effect fan_switch(Random& random) {
  return {.name = "fan_switch",
          .in_library = false,
          .covariates = {"fan_on"},
          .change = [](const Place& at, double size) { return size * at.conditions().fan_on; },
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
