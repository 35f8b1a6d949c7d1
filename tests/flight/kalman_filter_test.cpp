#include "flight/localisation/kalman_filter.h"

#include "flight/lidar/simulated_lidar.h"
#include "flight/localisation/scan_matcher.h"
#include "flight/tunnel/shapes.h"
#include "support/message_of.h"
#include "support/seeds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

constexpr double kStep_s = 0.0025;
const Eigen::Matrix2d kNoise = (Eigen::Matrix2d() << 4e-6, 1e-6, 1e-6, 9e-6).finished();

struct Random {
  std::mt19937_64 engine{test::seed()};
  std::normal_distribution<double> normal;
  Eigen::Vector2d vector() {
    const double y = normal(engine);
    return {y, normal(engine)};
  }
  Eigen::Vector2d measured(const Eigen::Vector2d& truth) { return truth + kNoise.llt().matrixL() * vector(); }
};

TEST(KalmanFilter, IntegratesAConstantAccelerationExactly) {
  KalmanFilter filter({1, 2});
  for (int i = 0; i < 400; ++i) filter.predict({0.5, -1}, kStep_s);
  EXPECT_TRUE(filter.position_m().isApprox(Eigen::Vector2d(1.25, 1.5), 1e-9));
  EXPECT_TRUE(filter.velocity_m_s().isApprox(Eigen::Vector2d(0.5, -1), 1e-9));
}

TEST(KalmanFilter, StepAndCorrectionAreTheTextbooksMatrices) {
  KalmanFilter filter({0.1, 0.2}, {}, {}, {.position_sigma_m = 0.3, .velocity_sigma_m_s = 0.7});
  Eigen::Matrix4d f = Eigen::Matrix4d::Identity();
  f.topRightCorner<2, 2>() = kStep_s * Eigen::Matrix2d::Identity();
  Eigen::Matrix<double, 4, 2> g;
  g << kStep_s * kStep_s / 2 * Eigen::Matrix2d::Identity(), kStep_s * Eigen::Matrix2d::Identity();
  Eigen::Vector4d x(0.1, 0.2, 0, 0);
  Eigen::Matrix4d p = Eigen::Vector4d(0.09, 0.09, 0.49, 0.49).asDiagonal();
  const Eigen::Matrix<double, 2, 4> h = Eigen::Matrix<double, 2, 4>::Identity();
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d a(0.3 * i, -0.1);
    filter.predict(a, kStep_s);
    x = f * x + g * a;
    p = f * p * f.transpose() + 0.0225 * g * g.transpose();
    if (i % 5 != 4) continue;
    const Eigen::Vector2d z(0.11, 0.19);
    EXPECT_TRUE(filter.correct(z, kNoise).accepted);
    const Eigen::Matrix2d s = h * p * h.transpose() + kNoise;
    const Eigen::Matrix<double, 4, 2> k = p * h.transpose() * s.inverse();
    x += k * (z - h * x);
    p = (Eigen::Matrix4d::Identity() - k * h) * p;
  }
  EXPECT_TRUE(filter.state().isApprox(x, 1e-10));
  EXPECT_TRUE(filter.covariance().isApprox(p, 1e-8));
}

TEST(KalmanFilter, CovarianceStaysPositiveDefiniteWithExtremeNoises) {
  KalmanFilter filter({0, 0}, {}, {}, {.position_sigma_m = 1e3, .velocity_sigma_m_s = 1e3});
  for (int i = 0; i < 20000; ++i) {
    filter.predict({0, 0}, kStep_s);
    if (i % 10 == 0) filter.correct({0, 0}, 1e-14 * Eigen::Matrix2d::Identity());
  }
  EXPECT_GE(filter.covariance().ldlt().vectorD().minCoeff(), 0);
  EXPECT_TRUE(filter.covariance().isApprox(filter.covariance().transpose(), 0));
}

/// A late correction gives the very estimate of a filter that had it in time.
TEST(KalmanFilter, LatencyIsMadeUpForExactly) {
  for (const double age_s : {0.0, 0.0025, 0.01, 0.0137, 0.05}) {
    SCOPED_TRACE(age_s);
    KalmanFilter late({0, 0});
    KalmanFilter prompt({0, 0});
    const auto acceleration = [](int i) { return Eigen::Vector2d(std::sin(0.1 * i), 0.3); };
    const int total = 60;
    const double at_s = total * kStep_s - age_s;
    bool corrected = false;
    for (int i = 0; i < total; ++i) {
      late.predict(acceleration(i), kStep_s);
      const double into_s = at_s - i * kStep_s;
      if (!corrected && into_s <= kStep_s + 1e-12) {
        prompt.predict(acceleration(i), into_s);
        prompt.correct({0.02, -0.01}, kNoise);
        if (kStep_s - into_s > 1e-9) prompt.predict(acceleration(i), kStep_s - into_s);
        corrected = true;
      } else {
        prompt.predict(acceleration(i), kStep_s);
      }
    }
    late.correct({0.02, -0.01}, kNoise, age_s);
    EXPECT_TRUE(late.state().isApprox(prompt.state(), 1e-9));
    EXPECT_TRUE(late.covariance().isApprox(prompt.covariance(), 1e-9));
  }
}

TEST(KalmanFilter, GateTurnsOutliersAwayAndReopens) {
  KalmanFilter filter({0, 0}, {}, {.sigma = 4, .most_rejections = 3});
  for (int i = 0; i < 50; ++i) {
    filter.predict({0, 0}, kStep_s);
    filter.correct({0, 0}, kNoise);
  }
  const Eigen::Vector4d before = filter.state();
  EXPECT_FALSE(filter.correct({1, 1}, kNoise).accepted);
  EXPECT_EQ(filter.state(), before);
  EXPECT_FALSE(filter.correct({1, 1}, kNoise).accepted);
  EXPECT_FALSE(filter.correct({1, 1}, kNoise).accepted);
  EXPECT_TRUE(filter.correct({1, 1}, kNoise).accepted);
  EXPECT_LT((filter.position_m() - Eigen::Vector2d(1, 1)).norm(), 0.01);
}

TEST(KalmanFilter, ABiasItDoesNotKnowOfDoesNotCarryItAway) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  Random random;
  KalmanFilter filter({0, 0});
  constexpr double kNoise_m = 0.002;
  const Eigen::Matrix2d noise = kNoise_m * kNoise_m * Eigen::Matrix2d::Identity();
  double worst_m = 0;
  for (int i = 1; i <= 400 * 20; ++i) {  // at rest for 20 s, with what a tilt error of 1.2° reads as
    filter.predict(Eigen::Vector2d(0.2, -0.2) + 0.15 * random.vector(), kStep_s);
    if (i % 10 == 0) filter.correct(kNoise_m * random.vector(), noise);
    worst_m = std::max(worst_m, filter.position_m().norm());
  }
  EXPECT_LT(worst_m, 0.05);
}

/// Mean NEES and NIS of a filter told the truth about its noises, over independent runs.
TEST(KalmanFilter, IsConsistent) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  Random random;
  constexpr int kRuns = 400;
  double nees = 0;
  double nis = 0;
  int corrections = 0;
  for (int run = 0; run < kRuns; ++run) {
    Eigen::Vector2d position = 0.05 * random.vector();
    Eigen::Vector2d velocity = 0.1 * random.vector();
    KalmanFilter filter({0, 0});
    for (int i = 1; i <= 200; ++i) {
      const Eigen::Vector2d truth(std::sin(0.02 * i), 0.2);
      position += kStep_s * velocity + 0.5 * kStep_s * kStep_s * truth;
      velocity += kStep_s * truth;
      filter.predict(truth + 0.15 * random.vector(), kStep_s);
      if (i % 10 != 0) continue;
      const Correction correction = filter.correct(random.measured(position), kNoise);
      nis += correction.nis;
      ++corrections;
    }
    Eigen::Vector4d error;
    error << filter.position_m() - position, filter.velocity_m_s() - velocity;
    nees += error.dot(filter.covariance().ldlt().solve(error)) / kRuns;
  }
  // Chi-square over 4 × 400 and 2 × 8000 degrees of freedom: five standard deviations
  EXPECT_NEAR(nees, 4, 5 * std::sqrt(2.0 * 4 / kRuns));
  EXPECT_NEAR(nis / corrections, 2, 5 * std::sqrt(2.0 * 2 / corrections));
}

/// Circles in a tunnel, with errors of attitude and accelerometer that stay what they are.
TEST(InertialFilter, IsConsistentAndFindsItsSensorsErrors) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  Random random;
  constexpr int kRuns = 200;
  const StartSettings start{.bias_sigma_m_s2 = 0.02, .roll_sigma_rad = 0.0035};
  const InertialModel constant{.roll_density_rad2_s = 0, .bias_density_m2_s5 = 0};
  double nees = 0;
  double roll_error = 0;
  for (int run = 0; run < kRuns; ++run) {
    const double roll_rad = start.roll_sigma_rad * random.vector().x();
    const Eigen::Vector2d bias = start.bias_sigma_m_s2 * random.vector();
    Eigen::Vector2d position(0.3, 0);
    Eigen::Vector2d velocity(0, 0.4);
    InertialFilter filter(position + start.position_sigma_m * random.vector(), constant, {}, start);
    for (int i = 1; i <= 6000; ++i) {  // 15 s
      const Eigen::Vector2d acceleration = -(0.4 / 0.3) * (0.4 / 0.3) * position;
      position += kStep_s * velocity + 0.5 * kStep_s * kStep_s * acceleration;
      velocity += kStep_s * acceleration;
      const Eigen::Vector2d force =
          acceleration + bias + Eigen::Vector2d(0, 9.80665) + 0.15 * random.vector();
      const Eigen::Vector2d turned(force.x() - roll_rad * force.y(), force.y() + roll_rad * force.x());
      filter.predict(turned - Eigen::Vector2d(0, 9.80665), kStep_s);
      if (i % 10 != 0) continue;
      const Eigen::Vector2d per_roll_m(-position.y(), position.x() + 0.1);
      filter.correct({random.measured(position + roll_rad * per_roll_m), kNoise, 0, per_roll_m});
    }
    Eigen::Matrix<double, 7, 1> error;
    error << filter.position_m() - position, filter.velocity_m_s() - velocity,
        filter.roll_error_rad() - roll_rad, filter.accelerometer_bias_m_s2() - bias;
    nees += error.dot(filter.covariance().ldlt().solve(error)) / kRuns;
    roll_error += error(4) * error(4) / kRuns;
  }
  // The velocity's start is 0.4 m/s off what the filter is told; 15 s later that is forgotten.
  EXPECT_NEAR(nees, 7, 5 * std::sqrt(2.0 * 7 / kRuns));
  EXPECT_LT(std::sqrt(roll_error), 0.7 * start.roll_sigma_rad);
}

TEST(InertialFilter, WithoutErrorsOfItsSensorsIsTheKinematicFilter) {
  const StartSettings none{.bias_sigma_m_s2 = 0, .roll_sigma_rad = 0};
  InertialFilter inertial({0.1, 0.2}, {.roll_density_rad2_s = 0, .bias_density_m2_s5 = 0}, {}, none);
  KalmanFilter kinematic({0.1, 0.2});
  for (int i = 0; i < 40; ++i) {
    inertial.predict({0.3 * i, -0.1}, kStep_s);
    kinematic.predict({0.3 * i, -0.1}, kStep_s);
    if (i % 10 != 9) continue;
    inertial.correct({{0.11, 0.19}, kNoise, 0.012, {0.4, 0.7}});
    kinematic.correct({0.11, 0.19}, kNoise, 0.012);
  }
  EXPECT_TRUE(inertial.state().head<4>().isApprox(kinematic.state(), 1e-12));
  const Eigen::Matrix4d covariance = inertial.covariance().topLeftCorner<4, 4>();
  EXPECT_TRUE(covariance.isApprox(kinematic.covariance(), 1e-10));
}

TEST(AugmentedFilter, IsConsistentAndFindsBiasAndForce) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  Random random;
  const AugmentedModel model;
  constexpr int kRuns = 200;
  double nees = 0;
  double force_error = 0;
  double bias_error = 0;
  for (int run = 0; run < kRuns; ++run) {
    Eigen::Vector2d position = 0.05 * random.vector();
    Eigen::Vector2d velocity = 0.1 * random.vector();
    Eigen::Vector2d disturbance = random.vector();
    Eigen::Vector2d bias = 0.1 * random.vector();
    AugmentedFilter filter({0, 0}, model);
    for (int i = 1; i <= 1200; ++i) {
      // Finer than the filter's steps, since d walks on within them
      const Eigen::Vector2d modelled(std::sin(0.01 * i), 0);
      constexpr int kParts = 4;
      for (int part = 0; part < kParts; ++part) {
        const double dt = kStep_s / kParts;
        const Eigen::Vector2d acceleration =
            modelled + disturbance + std::sqrt(model.acceleration_density_m2_s3 / dt) * random.vector();
        position += dt * velocity + 0.5 * dt * dt * acceleration;
        velocity += dt * acceleration;
        disturbance += std::sqrt(model.disturbance_density_m2_s5 * dt) * random.vector();
        bias += std::sqrt(model.bias_density_m2_s5 * dt) * random.vector();
      }
      filter.predict({modelled, modelled + disturbance + bias + 0.15 * random.vector()}, kStep_s);
      if (i % 10 == 0) filter.correct(random.measured(position), kNoise);
    }
    Eigen::Matrix<double, 8, 1> error;
    error << filter.position_m() - position, filter.velocity_m_s() - velocity,
        filter.disturbance_m_s2() - disturbance, filter.accelerometer_bias_m_s2() - bias;
    nees += error.dot(filter.covariance().ldlt().solve(error)) / kRuns;
    force_error += error.segment<2>(4).squaredNorm() / (2 * kRuns);
    bias_error += error.tail<2>().squaredNorm() / (2 * kRuns);
  }
  EXPECT_NEAR(nees, 8, 5 * std::sqrt(2.0 * 8 / kRuns));
  EXPECT_LT(std::sqrt(force_error), 0.15);  // of a force that starts at 1 m/s² and walks 0.7 in a second
  EXPECT_LT(std::sqrt(bias_error), 0.05);   // of 0.1
  AugmentedFilter still({0, 0});
  EXPECT_EQ(still.disturbance_m_s2(), Eigen::Vector2d(0, 0));
}

/// A constant push that no model knows of is measured.
TEST(AugmentedFilter, MeasuresAConstantForce) {
  Random random;
  AugmentedFilter filter({0, 0});
  const Eigen::Vector2d push_m_s2(0.4, -0.2);
  Eigen::Vector2d position(0, 0);
  Eigen::Vector2d velocity(0, 0);
  for (int i = 1; i <= 2000; ++i) {
    position += kStep_s * velocity + 0.5 * kStep_s * kStep_s * push_m_s2;
    velocity += kStep_s * push_m_s2;
    filter.predict({{0, 0}, push_m_s2 + 0.15 * random.vector()}, kStep_s);
    if (i % 10 == 0) filter.correct(random.measured(position), kNoise, 0);
  }
  EXPECT_LT((filter.disturbance_m_s2() - push_m_s2).norm(), 0.17);
}

/// Scans with 40 mm noise, the matcher's own covariance, 400 Hz prediction and the sweep's latency.
TEST(KalmanFilter, WithTheMatcherStaysWithinFiveMillimetres) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  Random random;
  const CrossSection square(box_outline(1.5, 1.5));
  SimulatedLidar lidar(square, {.range_sigma_m = 0.04}, test::seed());
  ScanMatcher matcher(square);
  const double radius = 0.3;
  const double speed = 0.46 * 3.14159265;  // rad/s
  const auto position = [&](double t) {
    return Eigen::Vector2d(radius * std::cos(speed * t), radius * std::sin(speed * t));
  };
  KalmanFilter filter(position(0), {}, {}, {.velocity_sigma_m_s = 0.5});
  double square_error = 0;
  double nees = 0;
  int steps = 0;
  const int total = 4000;
  for (int i = 1; i <= total; ++i) {
    const double t = i * kStep_s;
    // exact mean acceleration over the step, so that what is left is the stated noise
    const Eigen::Vector2d mean = -speed * speed * position(t - kStep_s / 2);
    filter.predict(mean + 0.15 * random.vector(), kStep_s);
    if (i % 10 == 0) {
      const double sweep_s = lidar.settings().sweep_s;
      const Scan scan = lidar.sweep({position(t - sweep_s), {}}, {position(t), {}});
      const Match match = matcher.match(scan, {}, filter.position_m(), {sweep_s, filter.velocity_m_s()});
      ASSERT_TRUE(match.accepted) << text(match.reason);
      filter.correct(match.position_m, match.covariance_m2, sweep_s / 2);
    }
    if (i < 400) continue;
    const Eigen::Vector2d error = filter.position_m() - position(t);
    square_error += error.squaredNorm() / 2;
    nees += error.dot(filter.covariance().topLeftCorner<2, 2>().inverse() * error);
    ++steps;
  }
  EXPECT_LT(std::sqrt(square_error / steps), 0.005);
  // Of 2. Neighbouring estimates share their errors: 360 corrections are some twenty independent ones.
  EXPECT_LT(nees / steps, 3.6);
  EXPECT_GT(nees / steps, 1);
}

TEST(KalmanFilter, BadInputIsAnError) {
  KalmanFilter filter({0, 0});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of([&] { filter.predict({nan, 0}, kStep_s); }), HasSubstr("not finite"));
  EXPECT_THAT(message_of([&] { filter.predict({0, 0}, -kStep_s); }), HasSubstr("time runs forwards"));
  EXPECT_THAT(message_of([&] { filter.predict({0, 0}, nan); }), HasSubstr("time runs forwards"));
  EXPECT_THAT(message_of([&] { filter.correct({nan, 0}, kNoise); }), HasSubstr("position is not finite"));
  EXPECT_THAT(message_of([&] { filter.correct({0, 0}, -kNoise); }), HasSubstr("positive definite"));
  EXPECT_THAT(message_of([&] { filter.correct({0, 0}, kNoise, -1); }), HasSubstr("negative"));
  EXPECT_THAT(message_of([&] { filter.correct({0, 0}, kNoise, 1); }), HasSubstr("older"));
  for (int i = 0; i < 20; ++i) filter.predict({0, 0}, kStep_s);
  filter.correct({0, 0}, kNoise, 0.01);
  EXPECT_THAT(message_of([&] { filter.correct({0, 0}, kNoise, 0.02); }), HasSubstr("older"));
  EXPECT_TRUE(filter.state().allFinite());
}

}  // namespace
}  // namespace tunnelrig
