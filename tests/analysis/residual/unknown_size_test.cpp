// How large structure without a name is said to be, and where it is drawn.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/tables.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;
using test::TablesTest;

struct UnknownSizeTest : TablesTest {};

/// A battery's voltage over what was taken from it: with the time nearly the same, a line over the one can
/// take back any line over the other.
TEST_F(UnknownSizeTest, WhatTheBaselineCanTakeBackIsNoPartOfIt) {
  std::string csv = "cell,Ah,t,u\n";
  for (int cell = 0; cell < 9; ++cell) {
    const double rate = 0.001 + 1e-6 * scatter(random), full_V = 4.1 + 0.01 * scatter(random);
    for (int k = 0; k < 50; ++k) {
      const double taken = (k + 0.2 * even(random)) / 50;
      csv += fmt::format("c{},{},{},{}\n", cell, taken, taken / rate * (1 + 1e-4 * scatter(random)),
                         full_V - 0.6 * taken - 0.3 * std::pow(taken, 6) + 0.01 * scatter(random));
    }
  }
  const Explanation e = explained(observed(csv,
                                           "groups = [\"cell\"]\nblocks = \"cell\"\n[response]\ncolumn = "
                                           "\"u\"\nunit = \"V\"\n[[covariates]]\ncolumn = \"Ah\"\n"
                                           "[[covariates]]\ncolumn = \"t\"\nunit = \"s\"\n",
                                           "linear:Ah"));
  ASSERT_FALSE(e.unknown.empty()) << explanation_text(e);
  // of 0.3 x⁶ less the line that fits it best: 0.12 V at the end, −0.06 V before
  EXPECT_GT(e.unknown[0].amplitude, 0.06);
  EXPECT_LT(e.unknown[0].amplitude, 0.15);
}

/// Three temperatures, and nothing between the second and the third.
TEST_F(UnknownSizeTest, ACurveIsDrawnWhereThereAreRows) {
  std::string csv = "T,u\n";
  for (int r = 0; r < 60; ++r) {
    const double celsius = r % 3 == 0 ? 21 : r % 3 == 1 ? 22 : 64;
    csv += fmt::format("{},{}\n", celsius, 20 + (celsius == 22 ? 1.5 : 0) + 0.1 * scatter(random));
  }
  const Explanation e =
      explained(observed(csv, "[response]\ncolumn = \"u\"\nunit = \"N\"\n[[covariates]]\ncolumn = \"T\"\n"));
  ASSERT_EQ(e.unknown.size(), 1u) << explanation_text(e);
  EXPECT_NEAR(e.unknown[0].amplitude, 0.75, 0.15);
  for (const ShapePoint& point : e.unknown[0].shape)
    EXPECT_TRUE(point.x == 21 || point.x == 22 || point.x == 64) << point.x;
}

}  // namespace
}  // namespace tunnelrig
