#include "calibration/propellers.h"

#include "calibration/distributions.h"
#include "calibration/points.h"

#include <cmath>
#include <iostream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<PropellerTest> tests_of(const std::vector<std::vector<double>>& thrusts) {
  std::vector<PropellerTest> tests;
  for (std::size_t rotor = 0; rotor < thrusts.size(); ++rotor) {
    for (const double thrust : thrusts[rotor]) {
      tests.push_back({.propeller = std::string(1, static_cast<char>('A' + rotor)),
                       .rotor = static_cast<int>(rotor) + 1,
                       .direction = rotor < 2 ? "CCW" : "CW",
                       .thrust_N = thrust,
                       .line = static_cast<int>(tests.size()) + 2});
    }
  }
  return tests;
}

TEST(Propellers, WithoutTestsEveryFactorIsOneExactly) {
  const PropellerFactors factors = propeller_factors({}, 4);
  EXPECT_FALSE(factors.tested);
  EXPECT_TRUE(factors.uncertainty_known());
  EXPECT_EQ(factors.factor, Eigen::VectorXd::Ones(4));
  EXPECT_EQ(factors.covariance, Eigen::MatrixXd::Zero(4, 4));
}

TEST(Propellers, AFactorIsAMeanOverTheMeanOfMeans) {
  const PropellerFactors factors =
      propeller_factors(tests_of({{7.4, 7.6}, {7.0}, {8.0, 8.2, 8.4}, {7.9}}), 4);
  const double mean = (7.5 + 7.0 + 8.2 + 7.9) / 4;
  EXPECT_NEAR(factors.factor[0], 7.5 / mean, 1e-14);
  EXPECT_NEAR(factors.factor[2], 8.2 / mean, 1e-14);
  EXPECT_NEAR(factors.factor.mean(), 1, 1e-14);
  EXPECT_THAT(factors.propellers, ElementsAre("A", "B", "C", "D"));
  EXPECT_THAT(factors.repeats, ElementsAre(2, 1, 3, 1));
  EXPECT_EQ(factors.dof, 3);
  EXPECT_NEAR(factors.scatter_N, std::sqrt((2 * 0.01 + 2 * 0.04) / 3), 1e-12);
  EXPECT_GT(factors.covariance(1, 1), factors.covariance(0, 0));  // fewer repeats
  EXPECT_NEAR(factors.covariance.sum(), 0, 1e-15);                // their mean is fixed
  EXPECT_TRUE(factors.covariance.isApprox(factors.covariance.transpose(), 1e-12));
}

TEST(Propellers, WithoutAnyRepeatTheUncertaintyIsLeftOut) {
  const PropellerFactors factors = propeller_factors(tests_of({{7.4}, {7.0}, {8.0}, {7.9}}), 4);
  EXPECT_FALSE(factors.uncertainty_known());
  EXPECT_EQ(factors.dof, 0);
  EXPECT_TRUE(factors.covariance.isZero(0));
  EXPECT_NEAR(factors.factor[0], 7.4 / 7.575, 1e-14);
}

TEST(Propellers, UncertaintyCoversTheTrueFactors) {
  const unsigned seed = 70;
  std::cout << "seed " << seed << '\n';
  std::mt19937 engine(seed);
  std::normal_distribution<double> noise(0, 0.05);
  const std::vector<double> truth = {7.40, 7.35, 7.62, 7.55};
  const double mean = (7.40 + 7.35 + 7.62 + 7.55) / 4;
  constexpr int kTrials = 4000;
  int single = 0, difference = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<std::vector<double>> thrusts(4);
    for (std::size_t rotor = 0; rotor < 4; ++rotor) {
      for (std::size_t repeat = 0; repeat <= rotor; ++repeat)
        thrusts[rotor].push_back(truth[rotor] + noise(engine));
    }
    const PropellerFactors factors = propeller_factors(tests_of(thrusts), 4);
    const double t = student_t_quantile(0.975, factors.dof);
    const Eigen::MatrixXd& c = factors.covariance;
    single += std::abs(factors.factor[0] - truth[0] / mean) <= t * std::sqrt(c(0, 0)) ? 1 : 0;
    const double u = std::sqrt(c(1, 1) + c(3, 3) - 2 * c(1, 3));
    difference +=
        std::abs(factors.factor[1] - factors.factor[3] - (truth[1] - truth[3]) / mean) <= t * u ? 1 : 0;
  }
  for (const int held : {single, difference}) {
    EXPECT_GE(held, 0.93 * kTrials);
    EXPECT_LE(held, 0.97 * kTrials);
  }
}

TEST(Propellers, RefusesWhatIsAmbiguousNamingLines) {
  const auto refusal = [](const std::vector<PropellerTest>& tests) {
    return message_of([&] { propeller_factors(tests, 4); });
  };
  const auto sound = tests_of({{7.4, 7.5}, {7.0}, {8.0}, {7.9}});
  auto tests = sound;
  tests[1].propeller = "Z";
  EXPECT_THAT(refusal(tests),
              AllOf(HasSubstr("propellers.csv:3: propeller Z is on rotor 1"), HasSubstr("line 2")));
  tests = sound;
  tests[3].propeller = "B";
  EXPECT_THAT(refusal(tests),
              AllOf(HasSubstr("propellers.csv:5: propeller B is on rotor 3"), HasSubstr("line 4")));
  tests = sound;
  tests[1].direction = "CW";
  EXPECT_THAT(refusal(tests), HasSubstr("propellers.csv:3: propeller A turns CW, and CCW in line 2"));
  tests = sound;
  tests.pop_back();
  EXPECT_THAT(refusal(tests), HasSubstr("the propeller on rotor 4 has no test"));
  tests = sound;
  tests[2].thrust_N = 0;
  EXPECT_THAT(refusal(tests), HasSubstr("propellers.csv:4"));
  tests[2].rotor = 5;
  EXPECT_THAT(refusal(tests), HasSubstr("rotor 5 is none of 1 to 4"));
}

}  // namespace
}  // namespace tunnelrig
