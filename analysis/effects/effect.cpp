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

std::optional<std::size_t> Effect::change_point() const {
  for (std::size_t k = 0; k < parameters.size(); ++k)
    if (parameters[k].role == ParameterRole::kChangePoint) return k;
  return {};
}

std::vector<double> time_constants_s() {
  return {2, 3.2, 5, 8, 12.5, 20, 32, 50, 80, 125, 200, 320, 500, 800, 1250, 2000};
}

}  // namespace tunnelrig
