#include "calibration/distributions.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void expect_close(double value, double expected, double relative = 1e-8) {
  EXPECT_NEAR(value, expected, relative * std::abs(expected));
}

TEST(Distributions, AgreeWithPrintedTables) {  // to the tables' digits
  EXPECT_NEAR(normal_quantile(0.975), 1.959964, 5e-7);
  EXPECT_NEAR(student_t_quantile(0.975, 8), 2.306004, 5e-7);
  EXPECT_NEAR(student_t_quantile(0.995, 30), 2.749996, 5e-7);
  EXPECT_NEAR(student_t_two_sided_p(2.228139, 10), 0.05, 5e-8);
  EXPECT_NEAR(f_upper_p(3.708265, 3, 10), 0.05, 5e-8);
  EXPECT_NEAR(chi2_quantile(0.95, 5), 11.070498, 5e-7);
  EXPECT_NEAR(chi2_quantile(0.05, 10), 3.940299, 5e-7);
}

TEST(Distributions, AgreeWithClosedFormsFarIntoTheTails) {
  for (const double tail : {0.4, 0.05, 1e-3, 1e-6, 1e-10}) {
    // dof 1 is Cauchy's; dof 2 and F with two upper degrees of freedom are algebraic; chi-square with 2
    // exponential
    expect_close(student_t_quantile(tail, 1), -1 / std::tan(std::numbers::pi * tail));
    expect_close(student_t_quantile(tail, 2), (2 * tail - 1) / std::sqrt(2 * tail * (1 - tail)));
    expect_close(chi2_quantile(1 - tail, 2), -2 * std::log1p(-(1 - tail)));
    const double f = 4.5 * (std::pow(tail, -1 / 4.5) - 1);
    expect_close(f_upper_p(f, 2, 9), tail);
  }
}

TEST(Distributions, QuantilesInvertProbabilitiesForAnyDegreesOfFreedom) {
  for (const double dof : {0.7, 1.0, 2.5, 8.0, 33.3, 1e3, 1e5}) {
    for (const double p : {1e-8, 0.01, 0.3, 0.8, 0.975, 0.9999}) {
      const double tail = p < 0.5 ? p : 1 - p;
      expect_close(student_t_two_sided_p(student_t_quantile(p, dof), dof), 2 * tail);
      expect_close(chi2_upper_p(chi2_quantile(p, dof), dof), 1 - p);
    }
    EXPECT_EQ(student_t_quantile(0.5, dof), 0);
    expect_close(student_t_quantile(0.1, dof), -student_t_quantile(0.9, dof));
  }
}

TEST(Distributions, ManyDegreesOfFreedomAreTheNormalLimit) {
  EXPECT_EQ(student_t_quantile(0.975, kInfinity), normal_quantile(0.975));
  expect_close(student_t_quantile(0.975, 1e9), normal_quantile(0.975), 1e-8);
  expect_close(student_t_two_sided_p(1.96, kInfinity), student_t_two_sided_p(1.96, 1e9));
  expect_close(student_t_two_sided_p(4, 0.999e6), student_t_two_sided_p(4, 1.001e6),
               1e-6);  // where methods meet
  expect_close(f_upper_p(2, 4, kInfinity), f_upper_p(2, 4, 0.999e6), 1e-5);
}

}  // namespace
}  // namespace tunnelrig
