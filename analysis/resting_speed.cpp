#include "analysis/resting_speed.h"

#include <algorithm>
#include <vector>

namespace tunnelrig {

std::map<std::string, double> resting_speeds_rpm(const ObservationTable& table) {
  constexpr double kAtRest = 0.05;
  std::map<std::string, std::vector<double>> speeds;
  for (const Observation& row : table.rows) {
    std::vector<double>& of_group = speeds[row.group];
    if (row.speed_rpm.value_or(0) > 0) of_group.push_back(*row.speed_rpm);
  }
  std::map<std::string, double> resting;
  for (auto& [group, of_group] : speeds) {
    if (of_group.empty()) {
      resting[group] = 0;
      continue;
    }
    const auto quartile = of_group.begin() + static_cast<std::ptrdiff_t>(3 * (of_group.size() - 1) / 4);
    std::nth_element(of_group.begin(), quartile, of_group.end());
    resting[group] = kAtRest * *quartile;
  }
  return resting;
}

}  // namespace tunnelrig
