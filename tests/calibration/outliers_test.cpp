#include "calibration/outliers.h"

#include "calibration/deletions.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>
#include <vector>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct Data {
  Eigen::MatrixXd X;
  Eigen::VectorXd y;
};

/// y = 1 + 2 x + noise at evenly spaced x from 0 to 10.
Data line_with_noise(Eigen::Index n, double noise, std::mt19937& engine) {
  std::normal_distribution<double> normal(0, noise);
  Data data{Eigen::MatrixXd::Ones(n, 2), Eigen::VectorXd(n)};
  data.X.col(1) = Eigen::VectorXd::LinSpaced(n, 0, 10);
  for (Eigen::Index i = 0; i < n; ++i) data.y[i] = 1 + 2 * data.X(i, 1) + (noise > 0 ? normal(engine) : 0);
  return data;
}

std::vector<int> gross_rows(const Data& data, const GrossRule& rule = {}) {
  const auto tests = test_rows(data.X, data.y, rule);
  std::vector<int> rows;
  for (std::size_t i = 0; i < tests.size(); ++i) {
    if (tests[i].gross) rows.push_back(static_cast<int>(i));
  }
  return rows;
}

TEST(Outliers, DeletionResidualIsTheTestOfAMeanShift) {
  std::mt19937 engine(3);
  const Data data = line_with_noise(12, 0.1, engine);
  const auto tests = test_rows(data.X, data.y, {});
  double leverage = 0;
  for (std::size_t i = 0; i < tests.size(); ++i) {
    leverage += tests[i].leverage;
    // the t test of a column that is 1 in this row alone
    Eigen::MatrixXd wider(12, 3);
    wider << data.X, Eigen::VectorXd::Unit(12, static_cast<Eigen::Index>(i));
    const Eigen::MatrixXd inverse = (wider.transpose() * wider).inverse();
    const Eigen::VectorXd beta = inverse * wider.transpose() * data.y;
    const double variance = (data.y - wider * beta).squaredNorm() / 9;
    EXPECT_NEAR(tests[i].studentised, beta[2] / std::sqrt(variance * inverse(2, 2)), 1e-9);
  }
  EXPECT_NEAR(leverage, 2, 1e-12);  // the trace of a projection is its rank
}

TEST(Outliers, GrossRowsAreFoundWhereverTheyStand) {
  for (Eigen::Index bad = 0; bad < 10; ++bad) {
    std::mt19937 engine(10);
    Data data = line_with_noise(10, 0.02, engine);
    data.y[bad] += 1;
    EXPECT_THAT(gross_rows(data), ElementsAre(bad));
  }
}

TEST(Outliers, TwoAtOneEndDoNotHideEachOther) {
  std::mt19937 engine(10);
  Data data = line_with_noise(12, 0.02, engine);
  data.y[10] += 3;  // they tilt the ordinary line, which then passes close to them
  data.y[11] += 3;
  EXPECT_THAT(gross_rows(data), ElementsAre(10, 11));
}

TEST(Outliers, AnImprobableRowThatDoesNotMatterIsNotGross) {
  std::mt19937 engine(10);
  Data data = line_with_noise(12, 1e-5, engine);
  data.y[5] += 0.02;  // 2000 standard deviations, 0.1 % of the span
  EXPECT_THAT(gross_rows(data), IsEmpty());
  EXPECT_LT(test_rows(data.X, data.y, {})[5].p, 1e-6);
  EXPECT_THAT(gross_rows(data, {.share_of_span = 0.0005}), ElementsAre(5));
}

TEST(Outliers, RoundingIsNotAnOutlier) {
  std::mt19937 engine(10);
  const Data data = line_with_noise(15, 0, engine);
  for (const RowTest& test : test_rows(data.X, data.y, {.share_of_span = 0})) {
    EXPECT_FALSE(test.gross);
    EXPECT_GT(test.p, 0.05);
  }
}

TEST(Outliers, SoundDataKeepTheirRows) {
  const unsigned seed = 20260311;
  std::cout << "seed " << seed << '\n';
  std::mt19937 engine(seed);
  constexpr int kTrials = 2000;
  int accused = 0, suspected = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Data data = line_with_noise(10, 0.3, engine);
    const auto tests = test_rows(data.X, data.y, {.p = 0.01});
    accused +=
        std::any_of(tests.begin(), tests.end(), [](const RowTest& test) { return test.gross; }) ? 1 : 0;
    suspected +=
        std::any_of(tests.begin(), tests.end(), [](const RowTest& test) { return test.p < 0.05; }) ? 1 : 0;
  }
  // Bonferroni: at most 1 % for each of the two sizes of sets that ten rows allow, and 5 %
  EXPECT_LE(accused, 0.02 * kTrials + 3 * std::sqrt(0.02 * kTrials));
  EXPECT_LE(suspected, 0.05 * kTrials + 3 * std::sqrt(0.05 * kTrials));
  EXPECT_GE(suspected, 0.02 * kTrials);  // and it is not silent either
}

/// The fit of the rest by its definition, beside the one that was kept up to date.
void expect_fits_anew(const Data& data, const Removal& removal) {
  Eigen::Array<bool, Eigen::Dynamic, 1> keep =
      Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(data.X.rows(), true);
  for (std::size_t step = 0; step < removal.rests.size(); ++step) {
    if (step > 0) keep[removal.order[step - 1]] = false;
    const auto anew = regress(rows_where(data.X, keep), rows_where(data.y, keep));
    ASSERT_TRUE(anew) << "step " << step;
    const RestFit& rest = removal.rests[step];
    EXPECT_EQ(rest.dof, anew->dof);
    EXPECT_NEAR(rest.residual_sum, anew->residual_sum, 1e-9 * anew->residual_sum) << "step " << step;
    EXPECT_LT((rest.coefficients - anew->coefficients).cwiseAbs().maxCoeff(), 1e-10) << "step " << step;
    EXPECT_LT((rest.inverse_normal - anew->inverse_normal).norm(), 1e-9 * anew->inverse_normal.norm());
  }
}

TEST(Deletions, TheFitKeptUpToDateIsTheFitOfTheRest) {
  std::mt19937 engine(7);
  Data data = line_with_noise(300, 0.02, engine);
  for (Eigen::Index i = 0; i < 40; ++i) data.y[7 * i] += 1 + 1000 * static_cast<double>(i % 2);
  const Removal stepwise = remove_stepwise(data.X, data.y, 75);
  ASSERT_EQ(stepwise.rests.size(), 76U);
  expect_fits_anew(data, stepwise);
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(stepwise.order[i] % 7, 0) << i;  // the gross ones first
  std::vector<Eigen::Index> from_the_end;  // leaves a short lever at the other end
  for (Eigen::Index i = 300; i-- > 3;) from_the_end.push_back(i);
  expect_fits_anew(data, remove_in_order(data.X, data.y, from_the_end, 297));
}

TEST(Deletions, EndWhereTheRestDeterminesNothing) {
  Data data{Eigen::MatrixXd::Ones(8, 2), Eigen::VectorXd::LinSpaced(8, 0, 1)};
  data.X.col(1) << 0, 0, 0, 0, 0, 1, 2, 3;
  const Removal removal = remove_in_order(data.X, data.y, {7, 6, 5, 4}, 4);
  EXPECT_EQ(removal.rests.size(), 3U);
  EXPECT_EQ(removal.without(3), nullptr);
  EXPECT_NE(removal.without(2), nullptr);
}

TEST(Outliers, OfManyRowsTheGrossOnesAreFound) {
  std::mt19937 engine(4000);
  Data data = line_with_noise(4000, 0.02, engine);
  std::vector<int> bad;
  for (int i = 11; i < 4000; i += 83) bad.push_back(i);
  for (const int row : bad) data.y[row] += 2;
  EXPECT_EQ(gross_rows(data), bad);
}

TEST(Outliers, LeastTrimmedSquaresIgnoresAThirdOfTheRows) {
  std::mt19937 engine(4);
  Data data = line_with_noise(30, 0.01, engine);
  for (Eigen::Index i = 0; i < 10; ++i) data.y[3 * i] += 5 + static_cast<double>(i);
  const Eigen::VectorXd line = least_trimmed_squares(data.X, data.y);
  EXPECT_NEAR(line[0], 1, 0.03);
  EXPECT_NEAR(line[1], 2, 0.005);
}

}  // namespace
}  // namespace tunnelrig
