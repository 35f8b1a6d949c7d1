#include "analysis/table_reduction.h"
#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <cstddef>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(TablePicture, GroupsDifferByMoreThanColourAndTheAxisIsOfTheValues) {
  TableReduction reduction{.name = "t", .convention = Convention::kPropeller, .rows = {}, .groups = {}};
  for (const double level : {0.100, 0.102}) {
    TableGroup group{.name = fmt::format("g{}", level), .rows = {}};
    for (std::size_t i = 0; i < 5; ++i) {
      group.rows.push_back(reduction.rows.size());
      const double speed_rpm = 1000 + 500 * static_cast<double>(i);
      reduction.rows.push_back({i, group.name, speed_rpm, level + 0.001 * static_cast<double>(i), ""});
    }
    group.lowest_speed_rpm = 1000;
    reduction.groups.push_back(group);
  }
  const test::TemporaryFolder folder;
  ASSERT_EQ(draw_coefficients(reduction, folder / "t.svg"), std::nullopt);
  const std::string svg = read_text(folder / "t.svg");
  EXPECT_THAT(svg, HasSubstr("0.101<"));
  EXPECT_THAT(svg, Not(HasSubstr("0.02<"))) << "a tick far below every value";
  EXPECT_THAT(svg, HasSubstr("#gpPt6")) << "the first group's marker";
  EXPECT_THAT(svg, HasSubstr("#gpPt4")) << "the second group's";
}

}  // namespace
}  // namespace tunnelrig
