#include "attribution/effects/catalogue.h"

#include <cmath>

namespace tunnelrig::attribution {

// Thrust follows the square of the speed that the motors really ran at.
Effect rotor_speed(Random& /*random*/) {
  return {.name = "rotor_speed",
          .covariates = {"speed_rpm"},
          .change =
              [](const Place& at, double exponent) {
                const Conditions& run = at.conditions();
                // a speed that was chosen is in the baseline; what is left is the scatter about it
                const double chosen_rpm = kNominalSpeed_rpm * std::sqrt(run.speed_factor);
                return std::pow(run.speed_rpm / chosen_rpm, exponent) - 1;
              },
          .amplitude_name = "exponent",
          .scale_covariate =
              [](Conditions& run, double factor) {
                run.speed_rpm = kNominalSpeed_rpm + factor * (run.speed_rpm - kNominalSpeed_rpm);
              },
          .theory = 2};
}

}  // namespace tunnelrig::attribution
