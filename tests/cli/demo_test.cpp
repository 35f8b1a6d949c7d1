// The demo, with shorter runs: its map is the one that the thesis drew.
#include "analysis/maps/disturbance_map.h"
#include "cli/program.h"
#include "datasets/csv.h"
#include "support/field_claims.h"
#include "support/temporary_folder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::ProgramResult;
using testing::HasSubstr;

/// The value of a map's CSV at each node of its grid.
class Grid {
 public:
  explicit Grid(const std::filesystem::path& csv) {
    const Sheet sheet = read_csv(csv);
    EXPECT_EQ(sheet.columns, (std::vector<std::string>{"y_norm", "z_norm", "value_percent", "u95_percent"}));
    for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
      values_[{sheet.require_number(row, "y_norm"), sheet.require_number(row, "z_norm")}] =
          sheet.require_number(row, "value_percent");
    }
  }

  /// Bilinear between nodes, as flight reads it.
  double at(double y, double z) const {
    const double step = 0.05;
    const auto below = [&](double x) { return std::min(std::floor((x + 1) / step + 1e-9), 39.0); };
    const double i = below(y), j = below(z), u = (y + 1) / step - i, v = (z + 1) / step - j;
    return (1 - u) * (1 - v) * node(i, j) + u * (1 - v) * node(i + 1, j) + (1 - u) * v * node(i, j + 1) +
           u * v * node(i + 1, j + 1);
  }

  bool holds_origin() const { return values_.contains({0.0, 0.0}); }

 private:
  double node(double i, double j) const {
    const auto close = [](double k) { return std::round((-1 + 0.05 * k) * 1e9) / 1e9; };
    return values_.at({close(i), close(j)});
  }
  std::map<std::pair<double, double>, double> values_;
};

TEST(Demo, MakesAMapThatSatisfiesTheThesis) {
  const test::TemporaryFolder folder;
  const auto run = [&](const std::string& arguments) { return test::run_program(folder.path(), arguments); };
  const ProgramResult demo = run("demo --out 'the demo' --duration 5");
  EXPECT_EQ(demo.code, 0) << demo.error << demo.out;
  EXPECT_THAT(
      demo.out,
      HasSubstr("$ tunnelrig reduce --db 'the demo/campaign.db' --csv 'the demo/coefficients.csv'\n"));
  const auto lines = [&](const char* part) {
    std::size_t found = 0;
    for (auto at = demo.out.find(part); at != std::string::npos; at = demo.out.find(part, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(lines(" frames, "), 2u) << "the rest of the recording is in log.txt";
  EXPECT_THAT(read_text(folder / "the demo/log.txt"), HasSubstr("R0700"));
  EXPECT_TRUE(std::filesystem::exists(folder / "the demo/report.html"));
  const ProgramResult again = run("demo --out 'the demo'");
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.error, HasSubstr("the demo/campaign.db: is there already"));
  EXPECT_EQ(run("reduce --db 'the demo/campaign.db' --from-raw").code, 0);

  const Sheet coefficients = read_csv(folder / "the demo/coefficients.csv");
  const std::vector<std::string> first = {"location",      "y_norm",       "z_norm",  "runs",
                                          "c_t",           "c_t_std",      "c_t_u95", "u_percent",
                                          "u_percent_std", "u_percent_u95"};
  ASSERT_GE(coefficients.columns.size(), first.size());
  EXPECT_EQ(std::vector<std::string>(coefficients.columns.begin(), coefficients.columns.begin() + 10), first);
  EXPECT_EQ(coefficients.rows.size(), 42u + 1 + 10 + 9)
      << "one row per location, open space included, and nothing else";
  for (std::size_t row = 0; row < coefficients.rows.size(); ++row) {
    const std::string& location = coefficients.text(row, "location");
    const double c_t = coefficients.require_number(row, "c_t"),
                 u95 = coefficients.require_number(row, "c_t_u95");
    if (location == "OS") {
      EXPECT_NEAR(c_t, 0.1056, 2 * u95);
    }
    if (location == "OT") {
      EXPECT_NEAR(c_t, 0.1071, 2 * u95);
    }
  }

  const Grid delta_ct(folder / "the demo/maps/delta_ct.csv"),
      uneven(folder / "the demo/maps/uneven_thrust.csv");
  EXPECT_TRUE(delta_ct.holds_origin());
  test::expect_thesis_claims([&](double y, double z) { return delta_ct.at(y, z); },
                             [&](double y, double z) { return uneven.at(y, z); }, 0.35);
  EXPECT_NO_THROW(read_disturbance_map(folder / "the demo/maps/disturbance_map.json"));
}

}  // namespace
}  // namespace tunnelrig
