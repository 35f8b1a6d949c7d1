// Tables whose rows have an order: what steps, and what the row before does.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/tables.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;
using test::TablesTest;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

struct TableOrderTest : TablesTest {
  static constexpr const char* kCells =
      "groups = [\"cell\"]\n[response]\ncolumn = \"u\"\nunit = \"V\"\n"
      "[[covariates]]\ncolumn = \"F\"\nunit = \"N\"\n"
      "[[covariates]]\ncolumn = \"n\"\nmeaning = \"run_order\"\n";

  /// Three cells of 1 % hysteresis, one after another, each loaded and unloaded twice.
  std::string loaded_and_unloaded(bool counted_anew) {
    std::string csv = "cell,n,F,u\n";
    int n = 0;
    for (const char cell : {'a', 'b', 'c'}) {
      double before = 0;
      for (int k = 0; k < 33; ++k, ++n) {
        const int of_cycle = k % 16;
        const double force_N = 2 * (of_cycle <= 8 ? of_cycle : 16 - of_cycle);
        const double sign = force_N < before ? 1 : force_N > before ? -1 : 0;
        csv += fmt::format("{},{},{},{}\n", cell, counted_anew ? k : n, force_N,
                           0.05 + force_N * (1 + 0.01 * sign) + 0.005 * scatter(random));
        before = force_N;
      }
    }
    return csv;
  }
};

/// Each cell's number counts for itself: the row before is the own cell's, and no step is made of turning.
TEST_F(TableOrderTest, NumbersThatAreCountedAnewInEachGroupFollowTheFile) {
  const Observations over_all = observed(loaded_and_unloaded(false), kCells, "linear:F");
  random.seed(test::seed());
  const Observations anew = observed(loaded_and_unloaded(true), kCells, "linear:F");
  const auto said = Contains(HasSubstr("run_order is counted anew"));
  EXPECT_THAT(anew.left_out, said);
  EXPECT_THAT(over_all.left_out, Not(said));
  for (const Observations& o : {over_all, anew}) {
    const Explanation e = explained(o);
    ASSERT_EQ(names(e), "hysteresis ") << explanation_text(e);
    EXPECT_NEAR(e.adopted[0].parameters[0].value, 0.01, 0.001);
  }
}

/// Cells that are read at one time share a number: the row before is that of the own cell.
TEST_F(TableOrderTest, ReadingsOfOneTimeHaveTheOwnGroupBeforeThem) {
  std::string csv = "cell,n,F,u\n";
  for (int n = 0; n < 20; ++n)
    for (const char cell : {'a', 'b'}) csv += fmt::format("{},{},{},{}\n", cell, n, n % 7, n % 7 + 0.01 * n);
  const Observations o = observed(csv, kCells, "linear:F");
  EXPECT_THAT(o.left_out, Not(Contains(HasSubstr("counted anew"))));
  EXPECT_EQ(o.previous[0], -1);
  EXPECT_EQ(o.previous[1], -1);
  for (std::size_t row = 2; row < o.previous.size(); ++row)
    EXPECT_EQ(o.previous[row], static_cast<int>(row) - 2);
}

/// A jolt changes the gain of every cell, by another share.
TEST_F(TableOrderTest, AStepWithAmplitudesOfTheGroupsOwnIsPlacedByAllOfThem) {
  constexpr std::array<double, 4> kStep = {0.02, 0.05, -0.03, 0.08};
  for (const int first : {60, 96, 112}) {
    std::string csv = "cell,n,F,u\n";
    for (int n = 0; n < 160; ++n) {
      const auto cell = static_cast<std::size_t>(n % 4);
      const double force_N = 2 + 10 * even(random);
      csv += fmt::format(
          "{},{},{},{}\n", cell, n, force_N,
          0.01 + force_N * (1 + 0.1 * static_cast<double>(cell)) * (1 + (n >= first ? kStep[cell] : 0)) +
              0.01 * scatter(random));
    }
    const Explanation e =
        explained(observed(csv, "blocks = \"bins(n, 20)\"\n" + std::string(kCells), "linear:F"));
    ASSERT_EQ(names(e), "propeller_step ") << explanation_text(e);
    EXPECT_TRUE(std::ranges::none_of(e.suspect_rows, &SuspectRow::set_aside));
    const auto& [step, first_run] = std::array{e.adopted[0].parameters[0], e.adopted[0].parameters[1]};
    EXPECT_NEAR(first_run.value, first, 3);
    EXPECT_LE(first_run.low, first);
    EXPECT_GE(first_run.high, first);
    EXPECT_LT(first_run.high - first_run.low, 12);
    ASSERT_EQ(step.groups.size(), kStep.size());
    for (std::size_t cell = 0; cell < kStep.size(); ++cell)
      EXPECT_NEAR(step.groups[cell].value, kStep[cell], 0.004);
    EXPECT_LT(e.after.held_out_rmse, 1.6 * 0.01);
    EXPECT_THAT(e.adopted[0].confounded_with, Not(Contains("propeller_step")));
  }
}

/// To a file that begins behind a step it is a tare, of which nobody knows when it came.
TEST_F(TableOrderTest, AStepOfTheGroupsOwnHasEachOfThemOnBothSides) {
  constexpr std::array<double, 4> kTare_N = {0, 0, 0.6, 0.5};
  std::string csv = "file,order,rpm,y\n";
  for (int r = 0; r < 240; ++r) {
    const auto file = static_cast<std::size_t>(r / 60);
    const double rpm = 2000 + 6000 * even(random);
    const double tare_N = r >= 90 && r < 120 ? 0.4 : kTare_N[file];
    csv += fmt::format("{},{},{},{}\n", file, r, rpm,
                       6 * std::pow(rpm / 6000, 2) + tare_N + 0.01 * scatter(random));
  }
  const Explanation e = explained(
      observed(csv,
               "groups = [\"file\"]\nblocks = \"bins(order, 24)\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
               "meaning = \"thrust_N\"\n[speed]\ncolumn = \"rpm\"\nunit = \"rpm\"\n[propeller]\n"
               "diameter_m = 0.2\n[[covariates]]\ncolumn = \"order\"\nmeaning = \"run_order\"\n"));
  ASSERT_EQ(names(e), "mounting_step zero_offset ") << explanation_text(e);
  EXPECT_FALSE(e.adopted[0].term.per_group);
  EXPECT_TRUE(e.adopted[1].term.per_group);
}

}  // namespace
}  // namespace tunnelrig
