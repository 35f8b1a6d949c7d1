#include "calibration/cell_checks.h"

#include "calibration/known_truth.h"
#include "calibration/load_cell.h"

#include <cmath>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::cycle;
using test::nothing;
using test::Reading;
using test::take;

CellChecks checks_of(const std::vector<CalibrationPoint>& points) { return fit_load_cell(points).checks; }

TEST(CellChecks, WhatThePointsDoNotAllowIsAbsent) {
  auto points = take({{5}, {7}, {9}}, 0.001, 1, nothing);
  const CellChecks three = checks_of(points);
  EXPECT_FALSE(three.linearity);  // three points leave a parabola no freedom
  const CellChecks plain = checks_of(take({{5}, {6}, {7}, {9}}, 0.001, 1, nothing));
  EXPECT_TRUE(plain.linearity);
  EXPECT_FALSE(plain.lack_of_fit);
  EXPECT_FALSE(plain.repeatability);
  EXPECT_FALSE(plain.hysteresis);
  EXPECT_FALSE(plain.zero_return);
  EXPECT_FALSE(plain.creep);
  auto unordered = take(cycle(), 0.001, 1, nothing);
  unordered[5].sequence.reset();
  EXPECT_FALSE(checks_of(unordered).zero_return);
  EXPECT_FALSE(checks_of(unordered).creep);
  EXPECT_TRUE(checks_of(unordered).hysteresis);
  unordered[4].direction.clear();
  EXPECT_FALSE(checks_of(unordered).hysteresis);
}

TEST(CellChecks, SizesAreThoseThatWerePutIn) {
  const auto hysteresis = checks_of(take(cycle(), 0, 1, [](const Reading& r) {
                            return std::string(r.direction) == "down" ? 0.01 : 0;
                          })).hysteresis;
  ASSERT_TRUE(hysteresis);
  EXPECT_NEAR(hysteresis->down_minus_up_N, 0.05, 1e-9);  // 0.01 V at 0.2 V/N
  EXPECT_NEAR(hysteresis->largest_N.value(), 0.05, 1e-9);
  EXPECT_NEAR(hysteresis->percent_of_span, 0.5, 1e-7);
  EXPECT_LT(hysteresis->p, 1e-6);

  const auto linearity = checks_of(take(cycle(), 0, 1, [](const Reading& r) {
                           return 0.0002 * r.force_N * (r.force_N - 10);
                         })).linearity;
  ASSERT_TRUE(linearity);
  EXPECT_NEAR(linearity->curvature_V_per_N2, 0.0002, 1e-10);
  EXPECT_NEAR(linearity->bow_N, 0.0002 * 100 / 8 / 0.2, 1e-6);
  // the least squares line is not quite the nearest one, so that the largest deviation is a little larger
  EXPECT_GT(linearity->max_deviation_N, linearity->bow_N);
  EXPECT_LT(linearity->max_deviation_N, 1.5 * linearity->bow_N);
  EXPECT_NEAR(linearity->max_deviation_percent_of_span, 10 * linearity->max_deviation_N, 1e-9);

  auto drifting = take(cycle(), 0, 1, nothing);
  drifting.back().voltage_V += 0.006;
  const auto zero_return = checks_of(drifting).zero_return;
  ASSERT_TRUE(zero_return);
  EXPECT_NEAR(zero_return->change_N, 0.03, 1e-4);  // the last point bends the line a little

  auto creeping = take({{0}, {5}, {5}, {5}, {8}, {8}, {10}, {2}}, 0, 1, nothing);
  creeping[2].voltage_V += 0.001;
  creeping[3].voltage_V += 0.002;
  creeping[5].voltage_V -= 0.001;
  const auto creep = checks_of(creeping).creep;
  ASSERT_TRUE(creep);
  EXPECT_NEAR(creep->largest_N, 0.01, 1e-4);
  EXPECT_EQ(creep->stretches, 2);
  EXPECT_EQ(creep->longest, 3);
  EXPECT_FALSE(checks_of(creeping).zero_return);  // one zero only
}

TEST(CellChecks, RepeatabilityIsTheScatterWithinOneForceAndDirection) {
  auto points = take({{2, "up"}, {2, "up"}, {6, "up"}, {6, "up"}, {6, "up"}, {9, "up"}}, 0, 1, nothing);
  points[0].voltage_V += 0.002;
  points[1].voltage_V -= 0.002;
  points[2].voltage_V += 0.004;
  points[4].voltage_V -= 0.004;
  const auto checks = checks_of(points);
  ASSERT_TRUE(checks.repeatability);
  EXPECT_EQ(checks.repeatability->dof, 3);
  const double gain = fit_load_cell(points).gain_V_per_N;
  EXPECT_NEAR(checks.repeatability->std_N, std::sqrt((2 * 4e-6 + 2 * 16e-6) / 3) / gain, 1e-9);
  ASSERT_TRUE(checks.lack_of_fit);
  EXPECT_EQ(checks.lack_of_fit->dof_lack, 1);
  EXPECT_EQ(checks.lack_of_fit->dof_pure, 3);
}

}  // namespace
}  // namespace tunnelrig
