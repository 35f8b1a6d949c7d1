// What a term does to runs, and which ways there are to try an effect.
#include "analysis/residual/likelihood/candidates.h"
#include "analysis/residual/likelihood/joint_fit.h"
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Every condition that any effect asks for.
void add_every_covariate(Observations& o, std::mt19937_64& random) {
  for (const Effect& effect : all_effects())
    for (const std::string& name : effect.covariates)
      if (o.find(name) == nullptr) {
        if (name == "air_pressure_Pa")
          test::add_covariate(o, name, 97000, 103000, random);
        else if (name == "speed_rpm")
          test::add_covariate(o, name, 4500, 5500, random);
        else if (name == "relative_humidity")
          test::add_covariate(o, name, 0.2, 0.8, random);
        else
          test::add_covariate(o, name, 2, 12, random);
      }
}

TEST(Terms, CosinesOfAnExponentialAreItsIntegrals) {
  std::mt19937_64 random(test::seed());
  Observations o = test::simulate({.shapes = kShapes}, random);
  test::add_covariate(o, "time_since_motor_start_s", 0, 30, random);
  const double duration = 60;
  for (const double tau : {8.0, 20.0, 80.0, 500.0}) {
    const Term term{.effect = &test::effect_named("creep"), .parameters = {0.05, tau}};
    const TermResponse response = respond(term, o, o.value);
    ASSERT_EQ(response.value.size(), 1u + kShapes);
    for (Index row = 0; row < o.rows(); row += 7) {
      const double start = o.covariates[0].value(row, 0);
      constexpr int kSteps = 20000;
      std::array<double, 1 + kShapes> of_force{}, of_growth{};  // cosine coefficients; the mean is the first
      for (int step = 0; step < kSteps; ++step) {
        const double t = duration * (step + 0.5) / kSteps;
        const double grown = 1 - std::exp(-(start + t) / tau);
        for (std::size_t j = 0; j <= kShapes; ++j) {
          const double weight = (j == 0 ? 1.0 : 2.0) / kSteps *
                                std::cos(std::numbers::pi * static_cast<double>(j) * t / duration);
          of_force[j] += weight * (1 + 0.05 * grown);
          of_growth[j] += weight * grown;
        }
      }
      // A run's mean is of forces, its course over that mean.
      for (int j = 0; j <= kShapes; ++j) {
        const auto component = static_cast<std::size_t>(j);
        const double mean = of_force[0];
        const double integral = j == 0 ? std::log(mean) : of_force[component] / mean;
        const double derivative =
            j == 0 ? of_growth[0] / mean
                   : (of_growth[component] * mean - of_force[component] * of_growth[0]) / (mean * mean);
        // 32 times in the run: a midpoint rule, off by Δt²/24 · 2/T · (f′(T) − f′(0)) with |f′| ≤ 1/τ
        const double tolerance = 1.1 * std::pow(duration / 32, 2) / (6 * duration * tau);
        EXPECT_NEAR(response.value[component](row, 0), integral, 0.05 * tolerance)
            << "τ " << tau << " j " << j;
        EXPECT_NEAR(response.derivative[0][component](row, 0), derivative, tolerance)
            << "τ " << tau << " j " << j;
      }
    }
  }
}

TEST(Terms, DerivativesAreFiniteDifferencesOfTheValue) {
  std::mt19937_64 random(test::seed() + 1);
  Observations o = test::simulate({.channels = 2, .shapes = kShapes}, random);
  add_every_covariate(o, random);
  for (const Effect& effect : all_effects()) {
    if (!testability(effect, o).ok()) continue;
    SCOPED_TRACE(effect.name + " " + effect.form);
    const std::vector<Term> ways = ways_to_try(effect, o, o.all_rows());
    Term term = ways.at(ways.size() / 2);
    term.parameters[0] = 0.3 * std::min(effect.parameters[0].upper, 0.1);
    const TermResponse response = respond(term, o, o.value);
    for (std::size_t k = 0; k < term.parameters.size(); ++k) {
      if (effect.parameters[k].role == ParameterRole::kChangePoint) {
        EXPECT_TRUE(response.derivative[k].empty());
        continue;
      }
      const double step = 1e-5 * std::abs(term.parameters[k]);
      Term above = term, below = term;
      above.parameters[k] += step;
      below.parameters[k] -= step;
      const TermResponse high = respond(above, o, o.value), low = respond(below, o, o.value);
      for (std::size_t j = 0; j < high.value.size(); ++j) {
        const MatrixXd difference = (high.value[j] - low.value[j]) / (2 * step);
        EXPECT_LT((difference - response.derivative[k][j]).norm(),
                  1e-4 * response.derivative[k][j].norm() + 1e-12 / step);
      }
    }
  }
}

TEST(Terms, AnAmplitudeOfEachRowsOwnIsThatOfTheTermThere) {
  std::mt19937_64 random(test::seed());
  Observations o = test::simulate({.shapes = kShapes}, random);
  add_every_covariate(o, random);
  const VectorXd amplitude = VectorXd::LinSpaced(o.rows(), -0.3, 0.4);
  for (const std::string name : {"zero_drift_time", "creep", "hysteresis"}) {
    Term term = ways_to_try(test::effect_named(name), o, o.all_rows())[0];
    const TermResponse together = respond(term, amplitude, o, o.value);
    for (Index row = 0; row < o.rows(); ++row) {
      term.parameters[0] = amplitude(row);
      const TermResponse alone = respond(term, o, o.value);
      for (std::size_t j = 0; j < alone.value.size(); ++j) {
        EXPECT_EQ(together.value[j](row, 0), alone.value[j](row, 0)) << name;
        EXPECT_EQ(together.derivative[0][j](row, 0), alone.derivative[0][j](row, 0)) << name;
      }
    }
  }
}

TEST(Terms, WhatTakesMoreThanTheForceIsFarOffByANumber) {
  std::mt19937_64 random(test::seed());
  Observations o = test::simulate({}, random);
  test::add_covariate(o, "hours_in_session", 0, 10, random);
  const auto change = [&](double drift_N_h) {
    const Term term{.effect = &test::effect_named("zero_drift_time"), .parameters = {drift_N_h}};
    return respond(term, o, MatrixXd(o.value));
  };
  const TermResponse there = change(-2), further = change(-2 - 1e-6);  // 20 N of 7 N
  ASSERT_TRUE(there.value[0].allFinite());
  EXPECT_LT(there.value[0].minCoeff(), std::log(0.02)) << "no force is left";
  EXPECT_LT((further.value[0] - there.value[0] + 1e-6 * there.derivative[0][0]).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Terms, ActOnTheirRotorOnly) {
  std::mt19937_64 random(test::seed() + 2);
  Observations o = test::simulate({.channels = 4}, random);
  add_every_covariate(o, random);
  const Term term{.effect = &test::effect_named("span_drift_temperature"), .rotor = 2, .parameters = {0.01}};
  const TermResponse response = respond(term, o, o.value);
  for (Index c = 0; c < 4; ++c) EXPECT_EQ(response.value[0].col(c).norm() > 0, c == 2);
  o.in_tunnel[3] = false;
  const Term wake{.effect = &test::effect_named("wake_recirculation"), .parameters = {0.1, 20}};
  const TermResponse in_tunnel = respond(wake, o, o.value);
  EXPECT_EQ(in_tunnel.value[0].row(3).norm(), 0) << "open space has no wake that comes back";
  EXPECT_GT(in_tunnel.value[0].row(4).norm(), 0);
}

TEST(Terms, ChangePointsLeaveThreeBlocksOnEachSide) {
  std::mt19937_64 random(test::seed() + 3);
  for (const int blocks : {4, 5, 6, 9, 12}) {
    Observations o =
        test::simulate({.runs_of_block = std::vector<int>(static_cast<std::size_t>(blocks + 3), 4)}, random);
    add_every_covariate(o, random);
    std::vector<int> rows;  // three blocks are sealed
    for (const int row : o.all_rows()) {
      const int block = o.block[static_cast<std::size_t>(row)];
      if (block != 1 && block != 3 && block != blocks) rows.push_back(row);
    }
    for (const char* name : {"mounting_step", "propeller_step"}) {
      const std::vector<Term> ways = ways_to_try(test::effect_named(name), o, rows);
      EXPECT_EQ(ways.size(), static_cast<std::size_t>(std::max(0, blocks - 5))) << name;
      for (const Term& way : ways) {
        std::set<int> before, after;
        for (const int row : rows)
          (row < way.parameters[1] ? before : after).insert(o.block[static_cast<std::size_t>(row)]);
        EXPECT_GE(before.size(), 3u);
        EXPECT_GE(after.size(), 3u);
        EXPECT_EQ(before.size() + after.size(), static_cast<std::size_t>(blocks)) << "no block is cut in two";
      }
    }
  }
}

TEST(Terms, WaysAreRotorsShapesAndPairs) {
  std::mt19937_64 random(test::seed() + 4);
  Observations o = test::simulate({.channels = 4}, random);
  add_every_covariate(o, random);
  const auto rows = o.all_rows();
  EXPECT_EQ(ways_to_try(test::effect_named("air_pressure"), o, rows).size(), 1u);
  EXPECT_EQ(ways_to_try(test::effect_named("nonlinearity"), o, rows).size(), 5u)
      << "all alike, or one of four";
  EXPECT_EQ(ways_to_try(test::effect_named("creep"), o, rows).size(), 5 * time_constants_s().size());
  const std::vector<Term> pairs = ways_to_try(test::effect_named("crosstalk"), o, rows);
  EXPECT_EQ(pairs.size(), 12u);
  for (const Term& pair : pairs) EXPECT_NE(pair.rotor, pair.other);
}

/// Regressors must not hold the run's own measured force: its noise would then explain itself.
TEST(Terms, RegressorsSeeMeasuredForcesThroughTheGroupsConstantOnly) {
  std::mt19937_64 random(test::seed() + 5);
  Observations o = test::simulate({.channels = 2}, random);
  add_every_covariate(o, random);
  const auto rows = o.all_rows();
  // Two runs of one group, apart from each other, change places: the group's constant stays, and its scatter,
  // by which the sign of a difference is more or less sure.
  const auto group = [&](int row) { return o.group[static_cast<std::size_t>(row)]; };
  int first = 5, second = first + 10;
  while (group(second) != group(first)) ++second;
  MatrixXd y = o.y;
  y.row(first) << y(first, 0) + 0.05, y(first, 1) - 0.02;
  y.row(second) << y(second, 0) - 0.05, y(second, 1) + 0.02;
  test::set_y(o, y);
  Observations changed = o;
  y.row(first).swap(y.row(second));
  test::set_y(changed, y);
  ASSERT_GT((changed.value - o.value).norm(), 0.1);
  const MatrixXd predicted = predict_response(o, {}, rows),
                 predicted_changed = predict_response(changed, {}, rows);
  EXPECT_LT((predicted - predicted_changed).norm(), 1e-12);
  for (const Effect& effect : all_effects()) {
    if (!testability(effect, o).ok()) continue;
    for (Term way : ways_to_try(effect, o, rows)) {
      way.parameters[0] = 0.001;
      const TermResponse a = respond(way, o, predicted), b = respond(way, changed, predicted_changed);
      EXPECT_LT((a.derivative[0][0] - b.derivative[0][0]).norm(), 1e-9 * a.derivative[0][0].norm() + 1e-12)
          << way.label();
    }
  }
}

TEST(Terms, SealedRunsDoNotEnterThePrediction) {
  std::mt19937_64 random(test::seed() + 6);
  Observations o = test::simulate({}, random);
  std::vector<int> open;
  for (const int row : o.all_rows())
    if (o.block[static_cast<std::size_t>(row)] % 4 != 2) open.push_back(row);
  const MatrixXd predicted = predict_response(o, {}, open);
  MatrixXd y = o.y;
  for (const int row : o.all_rows())
    if (o.block[static_cast<std::size_t>(row)] % 4 == 2) y.row(row).array() += 0.3;
  test::set_y(o, y);
  EXPECT_EQ((predict_response(o, {}, open) - predicted).norm(), 0);
}

TEST(Terms, SayWhatIsMissing) {
  std::mt19937_64 random(test::seed() + 7);
  Observations o = test::simulate({}, random);
  EXPECT_THAT(testability(test::effect_named("air_humidity"), o).missing,
              testing::ElementsAre("relative_humidity", "air_temperature_C"));
  add_every_covariate(o, random);
  EXPECT_TRUE(testability(test::effect_named("air_humidity"), o).ok());
  o.not_usable["relative_humidity"] = "missing in 3 of 72 runs";
  EXPECT_THAT(testability(test::effect_named("air_humidity"), o).reason, testing::HasSubstr("3 of 72"));
  EXPECT_FALSE(testability(test::effect_named("crosstalk"), o).ok()) << "one channel";
  o.in_tunnel.assign(o.in_tunnel.size(), false);
  EXPECT_THAT(testability(test::effect_named("wake_recirculation"), o).reason, testing::HasSubstr("tunnel"));
}

/// Locations that differ, or a speed that does: without either the run before has no force of its own.
TEST(Terms, TheRunBeforeIsNoRegressorWhereAllForcesAreOne) {
  std::mt19937_64 random(test::seed() + 8);
  for (const bool locations : {false, true})
    for (const bool speeds : {false, true}) {
      Observations o = test::simulate({.groups = 12, .channels = 4}, random);
      add_every_covariate(o, random);
      const auto speed = std::ranges::find(o.covariates, "speed_rpm", &Covariate::name);
      for (Eigen::Index row = 0; row < o.rows(); ++row) {
        const double ratio = speeds && row % 3 == 0 ? 0.7 : 1;
        speed->value.row(row).setConstant(ratio * o.rig.nominal_speed_rpm);
        o.y.row(row).array() += 2 * std::log(ratio);
        if (!locations) o.y.row(row).array() -= 0.01 * o.group[static_cast<std::size_t>(row)];
      }
      for (const char* effect : {"hysteresis", "creep_recovery"})
        EXPECT_EQ(testability(test::effect_named(effect), o).ok(), locations || speeds) << effect;
    }
}

/// Hysteresis is no part of the force that the next run remembers: where the same run is repeated, the sign
/// of the difference would be that of the hysteresis.
TEST(Terms, WhatTheRunBeforeDidIsNoForce) {
  std::mt19937_64 random(test::seed() + 9);
  const Observations o = test::simulate({.groups = 12, .channels = 4}, random);
  const Term term{.effect = &test::effect_named("hysteresis"), .parameters = {0.01}};
  const std::vector<int> rows = o.all_rows();
  const MatrixXd forces = predict_response(o, {{term}, {}}, rows);
  EXPECT_GT(respond(term, o, forces).value[0].norm(), 0);
  for (Eigen::Index row = 1; row < o.rows(); ++row)
    if (o.group[static_cast<std::size_t>(row)] == o.group[0]) {
      EXPECT_NEAR(forces(row, 0) / o.known(row, 0), forces(0, 0) / o.known(0, 0), 1e-12);
    }
}

/// Which of two runs at one place had more force is the weather's to say, unless the speed made them differ.
TEST(Terms, ARunRepeatedAtItsPlaceHasNoSign) {
  std::mt19937_64 random(test::seed() + 10);
  Observations o = test::simulate({.groups = 12, .channels = 4}, random);
  const Term term{.effect = &test::effect_named("hysteresis"), .parameters = {0.01}};
  MatrixXd forces = o.value;
  o.group[2] = o.group[1];
  o.previous[2] = 1;
  const auto change = [&] { return respond(term, o, forces).value[0].row(2).cwiseAbs().maxCoeff(); };
  forces.row(2) = 1.002 * forces.row(1);
  EXPECT_NEAR(change(), 0, 1e-12);
  forces.row(2) = 1.2 * forces.row(1);
  EXPECT_NEAR(change(), 0.01, 1e-4);
  o.group[2] = o.group[1] + 1;
  forces.row(2) = 1.002 * forces.row(1);
  EXPECT_NEAR(change(), 0.01, 1e-4);
}

}  // namespace
}  // namespace tunnelrig
