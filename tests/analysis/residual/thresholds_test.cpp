// What happens at the low end of a wide range, and names that were found before what hides them was known.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/likelihood/curves.h"
#include "analysis/residual/tables.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using test::explained;

constexpr const char* kTime = "time_since_motor_start_s";

struct Thresholds : test::TablesTest {
  static constexpr double kRunSigma = 0.002;

  Observations with_time() {
    Observations o = test::four_rotors(3, kRunSigma, random);
    test::add_covariate(o, kTime, std::log(6), std::log(500), random);
    o.covariates.back().value = o.covariates.back().value.array().exp();
    return o;
  }
  static bool is_unknown_over(const Explanation& e, const std::string& covariate) {
    return std::ranges::any_of(e.unknown,
                               [&](const UnknownStructure& u) { return u.covariate == covariate; });
  }
};

/// A thrust that is another for the first 40 s is no exponential, nor two that cancel: of 6 to 500 s that is
/// the first fourteenth, where a wave over the seconds hardly bends.
TEST_F(Thresholds, AreNoTimeConstants) {
  constexpr int kCampaigns = 3;
  int unknown = 0, named = 0;
  for (int campaign = 0; campaign < kCampaigns; ++campaign) {
    Observations o = with_time();
    const auto early = (o.find(kTime)->value.col(0).array() < 40).cast<double>().matrix();
    const Eigen::MatrixXd step = 4 * kRunSigma * early.replicate(1, 4);
    test::set_y(o, o.y + step);
    const Explanation e = explained(o);
    unknown += is_unknown_over(e, kTime) ? 1 : 0;
    for (const AdoptedEffect& adopted : e.adopted)
      EXPECT_LT(std::abs(adopted.parameters[0].value), 40 * kRunSigma) << explanation_text(e);
    if (e.adopted.empty()) continue;
    ++named;
    EXPECT_LT(e.after.held_out_rmse, 1.1 * e.before.held_out_rmse) << explanation_text(e);
  }
  EXPECT_LE(named, 1) << "of " << kCampaigns;
  EXPECT_GE(unknown, kCampaigns - 1) << "of " << kCampaigns;
}

/// A warm-up is one, and needs no curve.
TEST_F(Thresholds, ATimeConstantNeedsNoCurve) {
  Observations o = with_time();
  test::add_effect(o, "motor_warm_up", {0.012, 60});
  const Explanation e = explained(o);
  ASSERT_EQ(e.adopted.size(), 1u) << explanation_text(e);
  EXPECT_EQ(e.adopted[0].parameters.size(), 2u) << "an amplitude and a time constant";
  EXPECT_FALSE(is_unknown_over(e, kTime));
}

TEST_F(Thresholds, WavesOverTheLogarithmAreTriedOverWideRanges) {
  Observations o = with_time();
  test::add_covariate(o, "narrow", 10, 50, random);
  test::add_covariate(o, "both_signs", -1, 50, random);
  std::set<std::string> over;
  for (const Curve& curve : curves_to_try(o, o.all_rows()))
    if (curve.shape == CurveShape::kLogWaves) over.insert(curve.covariate);
  EXPECT_THAT(over, testing::AllOf(testing::Contains(kTime), testing::Not(testing::Contains("narrow")),
                                   testing::Not(testing::Contains("both_signs"))));
}

TEST_F(Thresholds, WavesOverTheLogarithmAreDrawnEvenlyInIt) {
  Observations o = with_time();
  const Eigen::ArrayXd time_s = o.find(kTime)->value.col(0).array();
  const Eigen::VectorXd wave = (5 * kRunSigma * (2.2 * time_s.log()).sin()).matrix();
  test::set_y(o, o.y + wave.replicate(1, 4));
  const Explanation e = explained(o);
  const auto found =
      std::ranges::find_if(e.unknown, [](const UnknownStructure& u) { return u.covariate == kTime; });
  ASSERT_NE(found, e.unknown.end()) << explanation_text(e);
  const auto below_60 =
      std::ranges::count_if(found->shape, [](const ShapePoint& point) { return point.x < 60; });
  EXPECT_GE(below_60, 8) << "half of the decades";
}

/// At the same time in every run an exponential changes their courses and no mean: of those it has no size.
TEST_F(Thresholds, WhatOnlyTheCoursesShowHasNoSizeOfMeans) {
  Observations o = test::simulate({.channels = 4, .shapes = 6}, random);
  o.duration_s.setConstant(o.rows(), 20);
  test::add_covariate(o, kTime, 30, 30, random);
  test::add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
  const Explanation e = explained(o);
  EXPECT_EQ(e.detectable_by_effect.count("motor_warm_up"), 0u);
  ASSERT_EQ(e.detectable_by_effect.count("supply_voltage"), 1u);
  for (const auto& [name, size_N] : e.detectable_by_effect) EXPECT_GT(size_N, 1e-4) << name;
}

/// The drift of a zero looks like a warmer air's density until a curve over another condition is known and
/// then the density itself: asked again, it is nothing.
TEST_F(Thresholds, AnOlderNameIsAskedAgainByItself) {
  constexpr int kTables = 4;
  for (int table = 0; table < kTables; ++table) {
    std::string csv = "prop,day,rpm,T,temp,mood,D\n";
    for (int day = 0; day < 10; ++day)
      for (const double coefficient : {0.10, 0.11})
        for (int rpm = 3000; rpm <= 6000; rpm += 500) {
          const double air_C = 15 + 10 * even(random), mood = even(random), hz = rpm / 60.0;
          const double force_N = coefficient * 101325 / 287.058 / (air_C + 273.15) * hz * hz *
                                 std::pow(0.254, 4) * std::pow(rpm / 4500.0, 0.08) *
                                 (1 + 0.02 * std::sin(2 * std::numbers::pi * mood)) *
                                 (1 + 0.004 * scatter(random));
          csv += fmt::format("{},{},{},{},{},{},0.254\n", coefficient > 0.105 ? "B" : "A", day, rpm, force_N,
                             air_C, mood);
        }
    const Explanation e = explained(
        observed(csv,
                 "groups = [\"prop\"]\nblocks = \"day\"\n"
                 "[response]\ncolumn = \"T\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                 "[speed]\ncolumn = \"rpm\"\nunit = \"rpm\"\n"
                 "[propeller]\ndiameter_column = \"D\"\ndiameter_unit = \"m\"\n"
                 "[[covariates]]\ncolumn = \"temp\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n"
                 "[[covariates]]\ncolumn = \"mood\"\n",
                 "power:rpm"));
    EXPECT_TRUE(is_unknown_over(e, "mood")) << explanation_text(e);
    EXPECT_THAT(names(e), testing::Not(testing::HasSubstr("zero_drift"))) << explanation_text(e);
  }
}

}  // namespace
}  // namespace tunnelrig
