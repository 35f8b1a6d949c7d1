#include "analysis/effects/effect.h"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

namespace tunnelrig {

bool Effect::within_time() const {
  return std::any_of(covariates.begin(), covariates.end(),
                     [](const std::string& column) { return column == kTimeSinceMotorStart; });
}

std::string Effect::cause() const { return form_is_axis ? name + " (" + form + ")" : name; }

std::string Effect::label(int rotor, int from) const {
  std::string text = name;
  if (!form.empty()) text += " (" + form + ")";
  if (from >= 0) text += fmt::format(" from rotor {}", from + 1);
  if (rotor >= 0) text += fmt::format(" {} rotor {}", from >= 0 ? "to" : "of", rotor + 1);
  return text;
}

std::vector<std::size_t> order_of_action(const std::vector<int>& stages) {
  std::vector<std::size_t> order(stages.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return stages[a] < stages[b]; });
  return order;
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
