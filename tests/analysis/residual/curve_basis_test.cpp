// Curves beyond the range in which they were seen.
#include "analysis/residual/likelihood/curves.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

constexpr double kLow = 2, kHigh = 6;

TEST(CurveBasis, WavesEndWithTheRange) {
  for (const int k : {1, 2, 5}) {
    const auto at = [&](double x) { return curve_column(CurveShape::kWaves, k, x, kLow, kHigh); };
    EXPECT_EQ(at(-3), at(kLow));
    EXPECT_EQ(at(40), at(kHigh));
    EXPECT_NEAR(at(kLow), 1, 1e-12);
    EXPECT_NEAR(at(3), std::cos(k * 0.25 * 3.14159265358979), 1e-12);
  }
}

TEST(CurveBasis, BendsGoOnForHalfOfTheRange) {
  for (const CurveShape shape : {CurveShape::kParabola, CurveShape::kLogParabola, CurveShape::kLevelling,
                                 CurveShape::kStraight, CurveShape::kLogStraight}) {
    const bool logarithm = is_of_logarithm(shape);
    const auto beyond = [&](double halves) {  // of the range, above it
      return logarithm ? kHigh * std::pow(kHigh / kLow, 0.5 * halves) : kHigh + 0.5 * halves * (kHigh - kLow);
    };
    const auto at = [&](double x) { return curve_column(shape, 1, x, kLow, kHigh); };
    EXPECT_NE(at(beyond(0.5)), at(kHigh)) << name_of(shape);
    EXPECT_NEAR(at(beyond(3)), at(beyond(1)), 1e-12) << name_of(shape);
    EXPECT_TRUE(std::isfinite(at(-1))) << name_of(shape);
  }
}

/// A condition that sealed runs alone take far away: what a curve does there the open ones cannot say.
TEST(CurveBasis, TheRangeIsThatOfTheOpenRuns) {
  std::mt19937_64 random{test::seed()};
  Observations o = test::simulate({.runs_of_block = std::vector<int>(12, 6)}, random);
  Covariate far{"far", Eigen::VectorXd::LinSpaced(o.rows(), 0, 1)};
  far.value.bottomRows(12).array() += 10;
  o.covariates = {far};
  std::vector<int> open(static_cast<std::size_t>(o.rows() - 12));
  std::iota(open.begin(), open.end(), 0);
  const std::vector<Curve> curves = curves_to_try(o, open);
  ASSERT_FALSE(curves.empty());
  for (const Curve& curve : curves) {
    EXPECT_LT(curve.high, 1) << curve.label();
    for (const Components& column : curve.columns) EXPECT_LE(column[0].cwiseAbs().maxCoeff(), 4);
  }
}

}  // namespace
}  // namespace tunnelrig
