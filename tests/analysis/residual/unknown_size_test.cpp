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

/// One row far from the others says nothing of what is between.
TEST_F(UnknownSizeTest, ACurveIsNotDrawnIntoAGap) {
  std::string csv = "day,T,u\n";
  for (int r = 0; r < 240; ++r) {
    const double celsius = r == 77 ? 80 : 20 + 10 * even(random);
    csv += fmt::format("{},{},{}\n", r / 15, celsius,
                       20 + std::sin(celsius / 10 * 2 * 3.14159) + 0.1 * scatter(random));
  }
  const Explanation e = explained(observed(csv,
                                           "blocks = \"day\"\n[response]\ncolumn = \"u\"\nunit = \"1\"\n"
                                           "[[covariates]]\ncolumn = \"T\"\n"));
  ASSERT_EQ(e.unknown.size(), 1u) << explanation_text(e);
  for (const ShapePoint& point : e.unknown[0].shape) EXPECT_TRUE(point.x < 32 || point.x > 79) << point.x;
}

/// The straight part of few values is the baseline's, and so is what is not known of it.
TEST_F(UnknownSizeTest, FewValuesOverTheBaselinesOwnColumnAreBesideItsLine) {
  std::string csv = "file,x,u\n";
  for (int file = 0; file < 12; ++file) {
    const double slope = 2 + 0.5 * scatter(random), constant = scatter(random);
    for (int k = 0; k < 14; ++k)
      csv += fmt::format("{},{},{}\n", file, k % 7 + 1,
                         constant + slope * (k % 7) + 0.3 * (k % 7 % 2) + 0.05 * scatter(random));
  }
  const Explanation e = explained(observed(csv,
                                           "groups = [\"file\"]\nblocks = \"file\"\n[response]\ncolumn = "
                                           "\"u\"\nunit = \"1\"\n[[covariates]]\ncolumn = \"x\"\n",
                                           "linear:x"));
  ASSERT_EQ(e.unknown.size(), 1u) << explanation_text(e);
  const auto& shape = e.unknown[0].shape;
  ASSERT_TRUE(e.unknown[0].levels);
  ASSERT_EQ(shape.size(), 7u);
  for (const ShapePoint& point : shape) {
    EXPECT_NEAR(point.y, (std::lround(point.x) % 2 == 0 ? 0.3 : 0) - 0.9 / 7, 0.06) << point.x;
    EXPECT_LT(point.high - point.low, 0.12) << point.x;
  }
}

/// What one rotor clips, where others clip far more.
TEST_F(UnknownSizeTest, ACurveOfOneRotorIsDrawnOverItsOwnRange) {
  Observations o = test::simulate(
      {.runs_of_block = std::vector<int>(16, 8), .channels = 4, .sigma = 0.002, .session_ratio = 0.3},
      random);
  Eigen::MatrixXd share(o.rows(), 4);
  for (double& of : share.reshaped()) of = even(random);
  share.col(0) *= 0.3;
  o.covariates.push_back({"share_of_something", share});
  Eigen::MatrixXd y = o.y;
  y.col(0) += 0.02 * (share.col(0).array() * (2 * 3.14159 / 0.3)).sin().matrix();
  test::set_y(o, y);
  const Explanation e = explained(o);
  ASSERT_FALSE(e.unknown.empty()) << explanation_text(e);
  EXPECT_EQ(e.unknown[0].rotor, 0);
  EXPECT_LE(e.unknown[0].shape.back().x, 0.3);
  EXPECT_NEAR(e.unknown[0].amplitude, 0.02 * 7, 0.4 * 0.02 * 7);
}

}  // namespace
}  // namespace tunnelrig
