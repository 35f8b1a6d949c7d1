// What is beyond chance and gets no name all the same; what is said beside a name.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::explained;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

struct Gates : testing::Test {
  std::mt19937_64 random{test::seed()};

  Observations observations() {
    return test::simulate({.runs_of_block = std::vector<int>(16, 12),
                           .groups = 4,
                           .channels = 4,
                           .sigma = 0.002,
                           .session_ratio = 0.2},
                          random);
  }
  static std::vector<std::string> names(const Explanation& e) {
    std::vector<std::string> result;
    for (const AdoptedEffect& adopted : e.adopted) result.push_back(adopted.term.effect->name);
    return result;
  }
  /// The thrust follows what the speed was; the covariate is what was read.
  void add_speed(Observations& o, double spread_rpm, double reading_rpm) {
    test::add_covariate(o, "speed_rpm", 5000 - spread_rpm, 5000 + spread_rpm, random);
    Covariate& speed = o.covariates.back();
    o.rig.nominal_speed_rpm = 5000;
    test::set_y(o, o.y.colwise() + VectorXd(2 * (speed.value.col(0).array() / 5000).log()));
    std::normal_distribution<double> reading(0, reading_rpm);
    for (Index row = 0; row < speed.value.rows(); ++row) speed.value(row, 0) += reading(random);
  }
};

/// More thrust for the first minute only: two exponentials of several times its size make that as well, one
/// against the other.
TEST_F(Gates, TwoFormulasThatCancelEachOtherAreNotBothNamed) {
  Observations o = observations();
  o.in_tunnel.assign(o.in_tunnel.size(), true);
  test::add_covariate(o, "time_since_motor_start_s", 20, 900, random);
  MatrixXd y = o.y;
  for (Index row = 0; row < y.rows(); ++row)
    if (o.covariates.back().value(row, 0) < 60) y.row(row).array() += 0.02;
  test::set_y(o, y);
  const Explanation e = explained(o);
  EXPECT_LE(e.adopted.size(), 1u) << explanation_text(e);
  for (const AdoptedEffect& adopted : e.adopted) EXPECT_LT(std::abs(adopted.parameters[0].value), 0.1);
}

/// The wind goes with what two causes do together: beside one of them the other explains more than it did.
TEST_F(Gates, ANameThatStoodForTwoCausesGivesWayToThem) {
  Observations o = observations();
  std::normal_distribution<double> normal(0, 1);
  VectorXd supply(o.rows()), cable(o.rows()), both(o.rows());
  for (Index row = 0; row < o.rows(); ++row) {
    supply(row) = normal(random);
    cable(row) = normal(random);
    both(row) = (supply(row) + cable(row)) / std::numbers::sqrt2 + 0.5 * normal(random);
  }
  o.covariates.push_back({"supply_voltage_V", 15.5 * (0.02 * supply).array().exp().matrix()});
  o.covariates.push_back({"cable_force_N", 0.14 * cable});
  o.covariates.push_back({"tunnel_airspeed_m_s", (20 + 3 * both.array()).sqrt().matrix()});
  test::add_effect(o, "supply_voltage", {1});
  test::add_effect(o, "cable_force", {1});
  const Explanation e = explained(o);
  ASSERT_FALSE(e.rounds.empty());
  EXPECT_THAT(e.rounds[0].outcome, HasSubstr("axial_wind")) << "the wind comes first";
  EXPECT_THAT(names(e), testing::UnorderedElementsAre("supply_voltage", "cable_force"));
}

TEST_F(Gates, SpeedIsNamedWhereItsReadingIsGood) {
  Observations o = observations();
  add_speed(o, 25, 0.5);
  EXPECT_THAT(names(explained(o)), testing::ElementsAre("rotor_speed"));
}

/// Readings that scatter more than the speed does: the thrust depends on them, but not by the square.
TEST_F(Gates, ANoisyTachometerIsNoBladeThatFlexes) {
  Observations o = observations();
  add_speed(o, 15, 14);
  const Explanation e = explained(o);
  const bool unknown_over_speed = std::ranges::any_of(
      e.unknown, [](const UnknownStructure& found) { return found.covariate == "speed_rpm"; });
  EXPECT_TRUE(unknown_over_speed || testing::Value(names(e), Contains("rotor_speed"))) << explanation_text(e);
  for (const char* name : {"blade_flex", "reynolds_number", "tip_mach"}) {
    EXPECT_TRUE(!testing::Value(names(e), Contains(name)) ||
                testing::Value(names(e), Contains("rotor_speed")))
        << explanation_text(e);
  }
}

TEST_F(Gates, WhatTakesBackTheSquareOfTheSpeedIsDoubted) {
  Observations o = observations();
  add_speed(o, 60, 0.1);
  const VectorXd u = (o.find("speed_rpm")->value.col(0).array() / 5000).log();
  test::set_y(o, o.y.colwise() - 0.4 * u);  // an exponent of 1.6
  const Explanation e = explained(o);
  ASSERT_THAT(names(e), Contains("rotor_speed"));
  ASSERT_GE(e.adopted.size(), 2u);
  EXPECT_THAT(e.warnings, Contains(HasSubstr("readings of speed_rpm that scatter by")));
}

/// More of it than physics allows is no name, nor is what is left of it on one rotor; how much it would be is
/// said.
TEST_F(Gates, WhatLiesBeyondItsBoundsIsSaidWithItsSize) {
  Observations o = observations();
  test::add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
  test::add_covariate(o, "tunnel_airspeed_m_s", 0, 0.4, random);
  const double most = test::effect_named("supply_voltage").parameters[0].upper;
  test::add_effect(o, "supply_voltage", {most + 1});
  const Explanation e = explained(o);
  EXPECT_THAT(names(e), testing::IsEmpty());
  EXPECT_EQ(e.verdict, "unknown");
  ASSERT_FALSE(e.unknown.empty());
  EXPECT_EQ(e.unknown[0].covariate, "supply_voltage_V");
  ASSERT_EQ(most, 4);
  EXPECT_THAT(e.warnings, Contains(testing::ContainsRegex(
                              "supply_voltage fitted best by far, but its exponent would be (4[.]9|5)")));
}

/// low/x would be the indicator of one run, and that run's scatter a dependence. A ladder of a few settings
/// is meant as it is.
TEST_F(Gates, WhatIsLowInOneRunOfManyDoesNotLevelOff) {
  Observations o = observations();
  test::add_covariate(o, "tunnel_airspeed_m_s", 0.2, 4, random);
  const auto levels_off = [&](const std::vector<int>& rows) {
    return std::ranges::any_of(curves_to_try(o, rows),
                               [](const Curve& curve) { return curve.shape == CurveShape::kLevelling; });
  };
  const std::vector<int> all = o.all_rows();
  EXPECT_TRUE(levels_off(all));
  o.covariates.back().value(7, 0) = 0.05;
  EXPECT_FALSE(levels_off(all));
  EXPECT_TRUE(levels_off({all.begin(), all.begin() + 20}));
}

TEST_F(Gates, AnEndAtMaxEffectsIsSaid) {
  Observations o = observations();
  test::add_covariate(o, "supply_voltage_V", 15, 16.5, random);
  test::add_covariate(o, "tunnel_airspeed_m_s", 0, 0.5, random);
  test::add_effect(o, "supply_voltage", {0.3});
  test::add_effect(o, "axial_wind", {-0.05});
  SearchSettings settings = test::quick();
  const auto said = Contains(HasSubstr("as many as --max-effects allows"));
  settings.most_effects = 1;
  EXPECT_THAT(explain(o, test::every_effect(), settings).warnings, said);
  settings.most_effects = 4;
  EXPECT_THAT(explain(o, test::every_effect(), settings).warnings, Not(said));
}

/// One effect of all rotors, and of one rotor the opposite: cells of which one does not drift.
TEST_F(Gates, OneRotorMayDifferFromWhatAllDo) {
  Observations o = observations();
  test::add_covariate(o, "cell_temperature_C", 15, 35, random);
  const VectorXd warmer = o.covariates.back().value.col(0).array() - 25;
  MatrixXd y = o.y.colwise() + 0.001 * warmer;
  y.col(3) -= 0.001 * warmer;
  test::set_y(o, y);
  const Explanation e = explained(o);
  EXPECT_EQ(e.adopted.size(), 2u) << explanation_text(e);
  EXPECT_LT(e.after.held_out_rmse, 1.3 * e.noise_floor);
  EXPECT_TRUE(e.unknown.empty()) << explanation_text(e);
}

/// That thrust goes with the square of the speed is not what a curve over the speed puts in doubt.
TEST_F(Gates, TheSquareOfTheSpeedStaysBesideACurveOverTheSpeed) {
  Observations o = observations();
  add_speed(o, 60, 0);
  const VectorXd speed = o.find("speed_rpm")->value.col(0);
  MatrixXd y = o.y;
  y.colwise() += VectorXd(0.02 * (4 * std::numbers::pi * (speed.array() - 4940) / 120).cos());  // resonances
  test::set_y(o, y);
  const Explanation e = explained(o);
  EXPECT_THAT(names(e), Contains("rotor_speed")) << explanation_text(e);
  ASSERT_EQ(e.unknown.size(), 1u) << explanation_text(e);
  EXPECT_EQ(e.unknown[0].covariate, "speed_rpm");
}

/// Between them a wave has any height.
TEST_F(Gates, FourSpeedsThatScatterALittleAreNoPlaceForWaves) {
  Observations o = observations();
  std::normal_distribution<double> scatter(0, 3);
  Covariate speed{"speed_rpm", MatrixXd(o.rows(), 1)}, any = speed;
  any.name = "fan_rpm";
  for (Index row = 0; row < o.rows(); ++row) {
    speed.value(row, 0) = 3500 + 1000 * static_cast<double>(row % 4) + scatter(random);
    any.value(row, 0) = 3500 + 500 * scatter(random);
  }
  o.covariates = {speed, any};
  bool of_any = false;
  for (const Curve& curve : curves_to_try(o, o.all_rows())) {
    if (curve.shape != CurveShape::kWaves) continue;
    EXPECT_NE(curve.covariate, "speed_rpm");
    of_any = of_any || curve.covariate == "fan_rpm";
  }
  EXPECT_TRUE(of_any);
}

}  // namespace
}  // namespace tunnelrig
