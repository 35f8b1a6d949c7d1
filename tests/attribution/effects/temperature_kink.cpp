#include "attribution/effects/catalogue.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace tunnelrig::attribution {

namespace {

/// The temperature that a share of a campaign's runs are below.
double temperature_C(const World& world, double share) {
  std::vector<double> all;
  for (const Conditions& run : world.runs) all.push_back(run.air_temperature_C);
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size()));
  std::nth_element(all.begin(), middle, all.end());
  return *middle;
}

}  // namespace

// Made up: one rotor of which thrust bends away below and above a temperature of its own. That lies among
// the campaign's: beside them all the bend would be a straight line, and not outside anybody's list.
Effect temperature_kink(Random& random) {
  const double share = random.uniform(0.35, 0.65);
  return {.name = "temperature_kink",
          .in_library = false,
          .covariates = {"air_temperature_C"},
          .rotor = random.below(kRotors),
          .fixed = {{"runs_below_corner", "1", share}},
          .change =
              [share](const Place& at, double size) {
                return size * std::abs(at.conditions().air_temperature_C - temperature_C(at.world, share));
              },
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
