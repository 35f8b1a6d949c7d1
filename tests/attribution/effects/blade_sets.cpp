#include "attribution/effects/catalogue.h"

#include <array>

namespace tunnelrig::attribution {

// Made up: three sets of blades for one rotor, none of which pulls like another.
Effect blade_sets(Random& random) {
  std::array<double, kBladeSets> pull{};
  for (double& one : pull) one = random.normal();
  return {.name = "blade_sets",
          .in_library = false,
          .covariates = {"blade_set"},
          .rotor = random.below(kRotors),
          .change = [pull](const Place& at, double size) { return size * pull[at.conditions().blade_set]; }};
}

}  // namespace tunnelrig::attribution
