// Intervals hold what they say they hold, over many simulated samples.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/search/step_profile.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

struct Intervals : testing::Test {
  std::mt19937_64 random{test::seed()};
  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(random); }

  /// How often the interval of a held-out error holds its true value √(1 + session²), of blocks of six runs:
  /// `sealed` blocks, with `open` others beside them. `heavy`: Student's t of four degrees of freedom.
  double coverage_of_error(int sealed, int open, double session, bool heavy = false) {
    constexpr int kSamples = 600, kRuns = 6;
    const std::vector<int> blocks(static_cast<std::size_t>(sealed + open), kRuns);
    const Observations o = test::simulate({.runs_of_block = blocks, .groups = 1}, random);
    std::student_t_distribution<double> tails(4);
    int held = 0;
    for (int i = 0; i < kSamples; ++i) {
      HeldOutErrors of_sealed, of_open;
      for (const int row : o.all_rows())
        (o.block[static_cast<std::size_t>(row)] < sealed ? of_sealed : of_open).rows.push_back(row);
      for (HeldOutErrors* part : {&of_sealed, &of_open}) {
        part->error.resize(static_cast<Eigen::Index>(part->rows.size()), 1);
        double offset = 0;
        for (Eigen::Index run = 0; run < part->error.rows(); ++run) {
          if (run % kRuns == 0) offset = normal(session);
          part->error(run, 0) = offset + (heavy ? tails(random) / std::sqrt(2.0) : normal(1));
        }
      }
      ErrorEstimate estimate;
      set_interval(o, of_sealed, of_open, static_cast<std::uint64_t>(i), estimate);
      const double truth = std::hypot(1, session);
      held += estimate.held_out_low <= truth && truth <= estimate.held_out_high ? 1 : 0;
    }
    return static_cast<double>(held) / kSamples;
  }

  /// Of groups whose values are 0, 1, 2 …
  static ParameterEstimate median_of(int groups) {
    std::vector<GroupEstimate> estimates;
    for (int g = 0; g < groups; ++g) estimates.push_back({"", 1.0 * g, g - 0.1, g + 0.1});
    return summary_of_groups({}, estimates);
  }

  double coverage_of_median(int groups) {
    constexpr int kSamples = 2000;
    int held = 0;
    for (int i = 0; i < kSamples; ++i) {
      std::vector<GroupEstimate> estimates;
      for (int g = 0; g < groups; ++g) {
        const double value = normal(1);
        estimates.push_back({"", value, value - 0.1, value + 0.1});
      }
      const ParameterEstimate summary = summary_of_groups({}, estimates);
      held += summary.low <= 0 && 0 <= summary.high ? 1 : 0;
    }
    return static_cast<double>(held) / kSamples;
  }
};

TEST_F(Intervals, OfAHeldOutErrorHoldIt) {
  for (const int blocks : {1, 2, 4, 12})
    EXPECT_GT(coverage_of_error(blocks, 0, 0), 0.93) << blocks << " blocks";
  EXPECT_LT(coverage_of_error(40, 0, 0), 0.99) << "wider than needed";
  for (const int blocks : {4, 12})
    EXPECT_GT(coverage_of_error(blocks, 0, 1), 0.88) << blocks << " blocks that differ";
}

TEST_F(Intervals, OfAHeldOutErrorLearnFromTheOpenBlocks) {
  EXPECT_GT(coverage_of_error(1, 8, 1.2), 0.92);
  for (const double session : {1.2, 3.0})
    for (const bool heavy : {false, true}) {
      const double coverage = coverage_of_error(5, 13, session, heavy);
      EXPECT_GT(coverage, 0.91) << session << " " << heavy;
      EXPECT_LT(coverage, 0.98) << session << " " << heavy;
    }
}

TEST_F(Intervals, OfTheMedianOfGroupsHoldIt) {
  for (const int groups : {6, 7, 9, 12, 24, 60}) {
    const double coverage = coverage_of_median(groups);
    EXPECT_GT(coverage, 0.935) << groups;
    EXPECT_LT(coverage, 0.995) << groups;
  }
}

/// A day's weather, and the day's own scatter with it.
TEST_F(Intervals, OfAGroupsAmplitudeAllowForSessions) {
  constexpr int kSamples = 60, kGroups = 3;
  int held = 0;
  for (int i = 0; i < kSamples; ++i) {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(14, 6), .groups = kGroups, .session_ratio = 2.5}, random);
    test::add_covariate(o, "supply_voltage_V", 15, 16, random);
    o.slopes.resize(o.rows(), 1);
    for (Eigen::Index run = 0; run < o.rows(); ++run)
      o.slopes(run, 0) = run % 6 == 0 ? normal(1) : o.slopes(run - 1, 0);
    const MeanModel model{
        {{.effect = &test::effect_named("supply_voltage"), .per_group = true, .parameters = {0}}}, {}};
    const JointFit fit = fit_jointly(o, model, o.all_rows());
    for (const GroupEstimate& own : estimate_by_group(o, fit.model, 0, fit.variances, o.all_rows()))
      held += own.low <= 0 && 0 <= own.high ? 1 : 0;
  }
  EXPECT_GT(held, 0.9 * kGroups * kSamples);
}

/// Where it is not the likeliest place: the step is sought on from a place beside it.
TEST_F(Intervals, OfAStepsFirstRunHoldIt) {
  constexpr int kSamples = 200;
  constexpr double kSigma = 0.002;
  for (const double size : {0.75, 1.5, 3.0}) {
    int held = 0;
    for (int i = 0; i < kSamples; ++i) {
      Observations o = test::simulate(
          {.runs_of_block = std::vector<int>(160, 1), .groups = 1, .sigma = kSigma, .session_ratio = 0},
          random);
      o.blocks_are_rows = true;
      o.covariates.push_back({"run_order", Eigen::VectorXd::LinSpaced(o.rows(), 0, 159), true});
      const int first = std::uniform_int_distribution<int>(40, 120)(random);
      test::add_effect(o, "propeller_step", {size * kSigma, static_cast<double>(first)});
      const Term beside{.effect = &test::effect_named("propeller_step"), .parameters = {0, first + 3.0}};
      const StepProfile profile =
          step_profile(o, {{beside}, {}}, 0, o.all_rows(), rows_where_a_step_may_begin(o, o.all_rows()));
      ASSERT_FALSE(profile.empty());
      held += profile.lowest() <= first && first <= profile.highest() ? 1 : 0;
    }
    EXPECT_GT(held, 0.91 * kSamples) << size << " sigma";
  }
}

/// A twentieth of the runs is too few to look for a step behind them, and no reason to say that it was later.
TEST_F(Intervals, OfAStepsFirstRunReachWhereNoneIsSought) {
  constexpr double kSigma = 0.002;
  constexpr int kFirst = 5;
  for (const bool at_end : {false, true}) {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(160, 1), .groups = 1, .sigma = kSigma, .session_ratio = 0},
        random);
    o.blocks_are_rows = true;
    o.covariates.push_back({"run_order", Eigen::VectorXd::LinSpaced(o.rows(), 0, 159), true});
    const int first = at_end ? 160 - kFirst : kFirst;
    test::add_effect(o, "propeller_step", {8 * kSigma, static_cast<double>(first)});
    const Term beside{.effect = &test::effect_named("propeller_step"),
                      .parameters = {0, at_end ? first - 10.0 : first + 10.0}};
    std::vector<Profiled> steps;
    with_change_points_of_all(o, {{beside}, {}}, steps);
    ASSERT_EQ(steps.size(), 1u);
    EXPECT_LE(steps[0].low, first);
    EXPECT_GE(steps[0].high, first);
    EXPECT_LT(steps[0].high - steps[0].low, 10);
  }
}

/// Of what has no name, about its mean: whatever its shape is.
TEST_F(Intervals, OfACurveHoldItsShape) {
  constexpr int kSamples = 30;
  constexpr double kSigma = 0.002;
  const auto straight = [](double x) { return 1.5 * x; };
  const auto bend = [](double x) { return 2.5 * x * x; };
  const auto wave = [](double x) { return 1.5 * std::sin(2.5 * x); };
  for (const std::function<double(double)>& shape :
       {std::function<double(double)>(straight), std::function<double(double)>(bend),
        std::function<double(double)>(wave)}) {
    double held = 0, points = 0;
    for (int i = 0; i < kSamples; ++i) {
      Observations o = test::simulate(
          {.runs_of_block = std::vector<int>(20, 8), .groups = 2, .sigma = kSigma, .session_ratio = 0},
          random);
      test::add_covariate(o, "humidity_of_paper", -1, 1, random);
      test::set_y(o, o.y + kSigma * o.find("humidity_of_paper")->value.unaryExpr(shape));
      const Explanation e = test::explained(o);
      ASSERT_EQ(e.unknown.size(), 1u);
      const auto& drawn = e.unknown[0].shape;
      const double scale = kSigma * o.value.mean();
      double mean = 0;
      for (const ShapePoint& point : drawn)
        mean += scale * shape(point.x) / static_cast<double>(drawn.size());
      for (const ShapePoint& point : drawn) {
        const double truth = scale * shape(point.x) - mean;
        held += point.low <= truth && truth <= point.high ? 1 : 0;
        ++points;
      }
    }
    EXPECT_GT(held, 0.88 * points);
  }
}

/// Half of n, and 1.96 times half of its root to either side.
TEST_F(Intervals, OfTheMedianOfAnyNumberOfGroups) {
  for (const int groups : {1000, 1100, 5000}) {
    const ParameterEstimate median = median_of(groups);
    const double half = 1.96 * std::sqrt(groups) / 2;
    EXPECT_NEAR(median.low, groups / 2.0 - half, 1.5) << groups;
    EXPECT_NEAR(median.high, groups / 2.0 + half, 1.5) << groups;
  }
}

}  // namespace
}  // namespace tunnelrig
