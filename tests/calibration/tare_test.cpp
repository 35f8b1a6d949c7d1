#include "calibration/tare.h"

#include "calibration/points.h"

#include <cmath>
#include <iostream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

TareReading tare(const char* session, double time_s, double mean_V, double standard_error_V = 0) {
  TareReading reading{.session = session, .time_s = time_s, .run = fmt::format("tare of {:g} V", mean_V)};
  for (std::size_t channel = 0; channel < kMaxRotors; ++channel) {
    reading.mean_V[channel] = mean_V + static_cast<double>(channel);
    reading.standard_error_V[channel] = standard_error_V;
  }
  return reading;
}

TEST(Tare, IsLinearBetweenAndConstantOutside) {
  const Tares tares({tare("S2", 500, 9), tare("S1", 300, 4), tare("S1", 100, 2)});
  for (const auto& [time, zero] :
       {std::pair{0.0, 2.0}, {100.0, 2.0}, {150.0, 2.5}, {300.0, 4.0}, {900.0, 4.0}}) {
    const auto found = tares.zero_at("S1", time);
    ASSERT_TRUE(found);
    for (std::size_t channel = 0; channel < kMaxRotors; ++channel) {
      EXPECT_NEAR(found->zero_V[channel], zero + static_cast<double>(channel), 1e-12) << time;
    }
    EXPECT_EQ(found->outside, time < 100 || time > 300);
    double sum = 0, zero_by_weights = 0;
    for (const auto& [index, weight] : found->weights) {
      sum += weight;
      zero_by_weights += weight * tares.readings()[index].mean_V[0];
    }
    EXPECT_NEAR(sum, 1, 1e-15);
    EXPECT_NEAR(zero_by_weights, zero, 1e-12);
  }
  EXPECT_NEAR(tares.zero_at("S2", 0)->zero_V[0], 9, 1e-12);
}

TEST(Tare, ASessionWithoutTareHasNoZeroOfItsOwn) {
  const Tares tares({tare("S1", 100, 2, 0.1)});
  EXPECT_FALSE(tares.zero_at("S9", 100));
  EXPECT_EQ(tares.covariance("S9", 1, 2, 0), 0);
  EXPECT_FALSE(Tares({}).zero_at("S1", 100));
}

TEST(Tare, RunsBetweenTheSameTaresShareTheirErrors) {
  const Tares tares({tare("S1", 0, 2, 0.3), tare("S1", 100, 2, 0.4)});
  EXPECT_EQ(tares.wander_dof(), 0);  // two tares say nothing of what is between them
  EXPECT_NEAR(tares.covariance("S1", 25, 25, 1), 0.5625 * 0.09 + 0.0625 * 0.16, 1e-15);
  EXPECT_NEAR(tares.zero_at("S1", 25)->standard_uncertainty_V[1],
              std::sqrt(tares.covariance("S1", 25, 25, 1)), 1e-15);
  EXPECT_NEAR(tares.covariance("S1", 25, 75, 1), 0.1875 * 0.09 + 0.1875 * 0.16, 1e-15);
  EXPECT_EQ(tares.covariance("S1", -10, 300, 1), 0);  // they rest on different tares
  EXPECT_NEAR(tares.covariance("S1", -10, -20, 1), 0.09, 1e-15);
}

/// A random walk measured with noise: what zero_at says of its own error is true, for pairs of runs too.
TEST(Tare, UncertaintyIsThatOfARandomWalkBetweenTares) {
  const unsigned seed = 3000;
  std::cout << "seeds " << seed << " and following\n";
  constexpr double kWander = 1e-8, kNoise = 1e-4, kStep_s = 100;  // V²/s, V
  const std::vector<int> tare_steps = {2, 8, 14, 16, 26};         // of 30
  struct Pair {
    int one, other;
  };
  const std::vector<Pair> pairs = {{5, 5}, {5, 7}, {20, 23}, {5, 10}, {0, 1}, {0, 0}, {27, 29}, {15, 15}};
  constexpr unsigned kTrials = 8000;
  std::vector<double> measured(pairs.size(), 0), said(pairs.size(), 0);
  std::vector<double> square(30, 0);
  double wander = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    std::mt19937 engine(seed + trial);
    std::normal_distribution<double> normal(0, 1);
    std::vector<double> zero(30, 1.0);
    for (std::size_t i = 1; i < 30; ++i)
      zero[i] = zero[i - 1] + std::sqrt(kWander * kStep_s) * normal(engine);
    std::vector<TareReading> readings;
    readings.reserve(tare_steps.size());
    for (const int step : tare_steps) {
      readings.push_back(
          tare("S1", step * kStep_s, zero[static_cast<std::size_t>(step)] + kNoise * normal(engine), kNoise));
    }
    const Tares tares(readings);
    EXPECT_EQ(tares.wander_dof(), 3);
    wander += tares.wander_V2_per_s(0) / kTrials;
    const auto error = [&](int step) {
      return tares.zero_at("S1", step * kStep_s)->zero_V[0] - zero[static_cast<std::size_t>(step)];
    };
    for (int step = 0; step < 30; ++step)
      square[static_cast<std::size_t>(step)] += std::pow(error(step), 2) / kTrials;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      measured[i] += error(pairs[i].one) * error(pairs[i].other) / kTrials;
      said[i] += tares.covariance("S1", pairs[i].one * kStep_s, pairs[i].other * kStep_s, 0) / kTrials;
    }
  }
  EXPECT_NEAR(wander, kWander, 0.05 * kWander);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto variance = [&](int step) { return square[static_cast<std::size_t>(step)]; };
    const double scatter =
        std::sqrt((variance(pairs[i].one) * variance(pairs[i].other) + said[i] * said[i]) / kTrials);
    EXPECT_NEAR(said[i], measured[i], 4 * scatter + 0.03 * said[i]) << pairs[i].one << ' ' << pairs[i].other;
  }
}

TEST(Tare, ASteadyDriftIsNotWander) {
  const Tares tares({tare("S1", 0, 1), tare("S1", 100, 2), tare("S1", 400, 5), tare("S1", 500, 6)});
  EXPECT_NEAR(tares.wander_V2_per_s(0), 0, 1e-15);
  EXPECT_EQ(tares.wander_dof(), 2);
}

TEST(Tare, RefusesTaresThatAreNone) {
  EXPECT_THAT(message_of([] { Tares({tare("S1", 5, std::nan(""))}); }), HasSubstr("session S1"));
  EXPECT_THAT(message_of([] { Tares({tare("S1", 5, 1, -1)}); }),
              HasSubstr("no finite mean and standard error"));
  EXPECT_THAT(
      message_of([] {
        Tares({tare("S1", 5, 1), tare("S1", 5, 2)});
      }),
      HasSubstr("session S1 has two tares at one time, tare of 1 V and tare of 2 V: correct start_utc"));
}

}  // namespace
}  // namespace tunnelrig
