#include "analysis/effects/effect.h"

#include <algorithm>

namespace tunnelrig {

bool Effect::within_time() const {
  return std::any_of(covariates.begin(), covariates.end(),
                     [](const std::string& column) { return column == "time_since_motor_start_s"; });
}

std::string Effect::cause() const {
  return name == "crosstalk" && !form.empty() ? name + " (" + form + ")" : name;
}

bool Effect::has_change_point() const {
  return std::any_of(parameters.begin(), parameters.end(), [](const EffectParameter& parameter) {
    return parameter.role == ParameterRole::kChangePoint;
  });
}

std::vector<double> time_constants_s() {
  return {2, 3.2, 5, 8, 12.5, 20, 32, 50, 80, 125, 200, 320, 500, 800, 1250, 2000};
}

}  // namespace tunnelrig
