// That the frozen gains are those of the vehicle that flies now.
#include "datasets/csv.h"
#include "flight/tuning/tuner.h"

#include <algorithm>
#include <regex>
#include <string>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

struct Recorded {
  std::string controller;
  double cost_mm = 0, default_cost_mm = 0;
};

std::vector<Recorded> recorded() {
  const std::string text = read_text(TUNNELRIG_GAINS);
  static const std::regex table(R"(\[([a-z-]+)\]  # cost ([0-9.]+) mm, ([0-9.]+) mm with the defaults)");
  std::vector<Recorded> result;
  for (auto match = std::sregex_iterator(text.begin(), text.end(), table); match != std::sregex_iterator();
       ++match)
    result.push_back({(*match)[1], std::stod((*match)[2]), std::stod((*match)[3])});
  return result;
}

/// Gains that were found for another plant (or another controller) flatter whoever loses less by them. After
/// a change of the simulation: `tunnelrig fly --tune flight/tuning/gains.toml`, and the numbers of
/// docs/flight.md.
TEST(FrozenGains, CostWhatTheirTablesSay) {
  const DisturbanceMap map = published_disturbance_map();
  const std::vector<Recorded> tables = recorded();
  const auto kinds = controller_kinds();
  ASSERT_EQ(static_cast<std::ptrdiff_t>(tables.size()),
            std::count_if(kinds.begin(), kinds.end(), [](const ControllerKind& kind) { return kind.tuned; }));
  for (const Recorded& table : tables) {
    constexpr double kShare = 0.01;
    EXPECT_NEAR(1e3 * tuning_cost_m(table.controller, frozen_gains(), map), table.cost_mm,
                kShare * table.cost_mm)
        << table.controller;
    EXPECT_NEAR(1e3 * tune(table.controller, map, {.budget = 1}).start_cost_m, table.default_cost_mm,
                kShare * table.default_cost_mm)
        << table.controller << " with the defaults";
  }
}

}  // namespace
}  // namespace tunnelrig
