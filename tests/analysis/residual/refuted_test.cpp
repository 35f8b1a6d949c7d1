// Names that do not stand: the seal refutes them, curves undo them, or they say what another column says.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/likelihood/candidates.h"
#include "analysis/residual/likelihood/curves.h"
#include "analysis/residual/tables.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::MatrixXd;
using test::effect_named;
using test::explained;
using test::TablesTest;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

struct Refuted : TablesTest {
  /// C_T over speed, 0.3 % of scatter, the upper third held out: a power law up to there, and behind it the
  /// same or back down.
  Observations coefficients(double back) {
    std::string csv = "b,N,y\n";
    for (int r = 0; r < 120; ++r) {
      const double along = even(random) * 1.5, rpm = 2000 + 4000 * along;
      const double c_t = 0.1 * std::pow(std::min(rpm, 6000.0) / 4000, 0.2) *
                         std::pow(std::max(rpm, 6000.0) / 6000, 0.2 - back);
      csv += fmt::format("{},{},{}\n", r / 10, rpm, c_t * (1 + 0.003 * scatter(random)));
    }
    return observed(csv,
                    "blocks = \"b\"\nhold_out = \"N > 6000\"\n[response]\ncolumn = \"y\"\nunit = \"1\"\n"
                    "meaning = \"c_t_propeller\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n"
                    "[propeller]\ndiameter_m = 0.25\n");
  }
};

TEST_F(Refuted, ANameThatPredictsTheHeldOutRowsStays) {
  const Explanation e = explained(coefficients(0));
  ASSERT_EQ(e.adopted.size(), 1u) << explanation_text(e);
  EXPECT_LT(e.after.held_out_rmse, 0.3 * e.before.held_out_rmse);
}

TEST_F(Refuted, ANameThatPredictsThemWorseThanNoneIsTakenBack) {
  const Explanation e = explained(coefficients(1.2));
  EXPECT_TRUE(e.adopted.empty()) << explanation_text(e);
  EXPECT_EQ(e.verdict, "unknown");
  EXPECT_EQ(e.after.held_out_rmse, e.before.held_out_rmse);
  EXPECT_THAT(e.warnings, Contains(AllOf(HasSubstr("taken back"), HasSubstr("sealed blocks"))));
  ASSERT_FALSE(e.unknown.empty());
  EXPECT_EQ(e.unknown[0].covariate, "speed_rpm");
}

/// A cell that two other axes leak into, less than in proportion at the largest loads, which are held out:
/// with these in, one coefficient is not told from 0, and they are predicted better without it.
TEST_F(Refuted, OfTwoAxesTheOneThatTheSealedBlocksNeedStays) {
  std::string csv = "axis,fx,fy,fz,y\n";
  for (const char axis : {'x', 'y', 'z'})
    for (const double load : {0, 150, 290, 590, 870}) {
      const double x = axis == 'x' ? load : 0, y = axis == 'y' ? load : 0, z = axis == 'z' ? load : 0;
      const double counts = 1850 * z - x * (8 - 0.006 * x) - y * (18 - 0.006 * y);
      csv += fmt::format("{},{},{},{},{}\n", axis, x, y, z, counts + 100 * scatter(random));
    }
  std::string schema =
      "groups = [\"axis\"]\nblocks = \"rows\"\nhold_out = \"fx == 870 || fy == 870 || fz == 870\"\n"
      "[response]\ncolumn = \"y\"\nunit = \"counts\"\n";
  for (const char axis : {'x', 'y', 'z'})
    schema += fmt::format("[[covariates]]\ncolumn = \"f{}\"\nunit = \"gf\"\n", axis);
  const Observations o = observed(csv, schema, "linear:fz");
  const TableEffects effects(o, test::every_effect());
  const Explanation e = explain(o, effects.all, test::quick());
  ASSERT_EQ(names(e), "crosstalk ") << explanation_text(e);
  EXPECT_EQ(e.adopted[0].term.effect->form, "fy");
  EXPECT_LT(e.after.held_out_rmse, 0.5 * e.before.held_out_rmse);
  EXPECT_THAT(e.warnings, Contains(HasSubstr("crosstalk (fx) was found and is taken back")));
}

/// One of two axes does the opposite in the rows held out: the other is not taken back with it.
TEST_F(Refuted, AnotherAxisIsAnotherCause) {
  std::string csv = "b,fx,fy,fz,y,held\n";
  for (int r = 0; r < 96; ++r) {
    const double fx = 10 * even(random), fy = 10 * even(random), fz = 10 * even(random);
    const bool held = r % 2 == 1;
    csv += fmt::format("{},{},{},{},{},{}\n", r / 6, fx, fy, fz,
                       fz + 0.02 * fy + (held ? -0.02 : 0.02) * fx + 0.01 * scatter(random), held ? 1 : 0);
  }
  std::string schema = "blocks = \"b\"\nhold_out = \"held == 1\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n";
  for (const char axis : {'x', 'y', 'z'})
    schema += fmt::format("[[covariates]]\ncolumn = \"f{}\"\nunit = \"N\"\n", axis);
  const Observations o = observed(csv, schema, "linear:fz");
  const TableEffects effects(o, test::every_effect());
  const Explanation e = explain(o, effects.all, test::quick());
  ASSERT_EQ(names(e), "crosstalk ") << explanation_text(e);
  EXPECT_EQ(e.adopted[0].term.effect->form, "fy");
  EXPECT_THAT(e.warnings, Contains(HasSubstr("crosstalk (fx) was found and is taken back")));
}

/// Rows held out at the reference, where the effect does nothing: whether it makes their error larger is
/// chance.
TEST_F(Refuted, RowsInWhichAnEffectDoesNothingSpeakNeitherForItNorAgainstIt) {
  int larger = 0, doubted = 0;
  for (int table = 0; table < 10; ++table) {
    std::string csv = "b,V,y\n";
    for (int r = 0; r < 64; ++r) {
      const double volts = r % 32 < 8 ? test::kMiddle_V : 10.5 + 2 * (r % 8 + even(random)) / 8;
      const double force_N = 8 * std::pow(volts / test::kMiddle_V, 0.15) * (1 + 0.003 * scatter(random));
      csv += fmt::format("{},{},{}\n", r / 8, volts, force_N);
    }
    const Explanation e =
        explained(observed(csv,
                           "blocks = \"b\"\nhold_out = \"V == 11.5\"\n"
                           "[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                           "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"));
    EXPECT_EQ(names(e), "supply_voltage ") << explanation_text(e);
    doubted += testing::Value(e.warnings, Contains(HasSubstr("doubt it")));
    larger += e.after.held_out_rmse > e.before.held_out_rmse;
  }
  EXPECT_GE(larger, 1);
  EXPECT_LE(doubted, 2);  // one of forty is beyond two standard errors
}

/// A battery's name beside its voltage says nothing more.
TEST_F(Refuted, TextsThatStandForNumbersDoNotTakeTheirName) {
  const std::vector<double> volts = {10, 11.2, 12.1, 13.4, 14.8};
  std::string csv = "b,V,pack,y\n";
  for (int r = 0; r < 120; ++r) {
    const double v = volts[static_cast<std::size_t>(r) % volts.size()];
    csv += fmt::format("{},{},pack{},{}\n", r / 10, v, v,
                       8 * std::pow(v / 12, 1.5) * (1 + 0.003 * scatter(random)));
  }
  const Observations o =
      observed(csv,
               "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
               "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"
               "[[covariates]]\ncolumn = \"pack\"\nunit = \"text\"\n");
  const Explanation e = explained(o);
  EXPECT_EQ(names(e), "supply_voltage ") << explanation_text(e);
  EXPECT_THAT(e.warnings, Contains(HasSubstr("pack has one supply_voltage_V for each of its texts")));
  for (const Curve& curve : curves_to_try(o, o.all_rows())) EXPECT_NE(curve.covariate, "pack");
}

TEST_F(Refuted, AStepIsTriedOnlyWhereAGroupGoesOnAcrossIt) {
  std::string csv = "g,b,run_order,y\n";
  for (int r = 0; r < 96; ++r)
    csv += fmt::format("{},{},{},{}\n", r < 48 ? "first" : "second", r / 6, r, 5 + 0.1 * scatter(random));
  const Observations o =
      observed(csv,
               "groups = [\"g\"]\nblocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
               "[[covariates]]\ncolumn = \"run_order\"\nunit = \"1\"\n");
  std::vector<double> points;
  for (const Term& way : ways_to_try(effect_named("propeller_step"), o, o.all_rows()))
    for (std::size_t k = 0; k < way.parameters.size(); ++k)
      if (way.effect->parameters[k].role == ParameterRole::kChangePoint) points.push_back(way.parameters[k]);
  EXPECT_THAT(points, Contains(42));
  EXPECT_THAT(points, Contains(54));
  EXPECT_THAT(points, testing::Not(Contains(48)));
}

/// What is left of a column that the baseline has is rounding: as an adopted one it took any amplitude, and
/// with it all of the scatter.
TEST_F(Refuted, AColumnThatTheBaselineHasChangesNoVariance) {
  Observations o = test::simulate({.groups = 1, .sigma = 0.01}, random);
  const auto drawn = [&] { return MatrixXd::NullaryExpr(o.rows(), 1, [&] { return even(random); }).eval(); };
  o.slopes = drawn();
  const std::vector<int> rows = o.all_rows();
  const MixedModel model(o, rows);
  const Components y = {o.y};
  const Components other = {drawn()};
  const Components has = {3.7 * o.slopes + MatrixXd::Constant(o.rows(), 1, 0.31)};
  const NullFit without = CandidateScan(model, {other}, {}).null_fit(y);
  const NullFit with = CandidateScan(model, {other, has}, {}).null_fit(y);
  EXPECT_DOUBLE_EQ(with.sigma[0], without.sigma[0]);
  EXPECT_DOUBLE_EQ(with.log_likelihood, without.log_likelihood);
}

/// Creep and a wake that builds up are nearly the same, and of eight short sessions the time constant is
/// hardly known: the interval of either amplitude may hold 0. Whichever stays, the other is in its set.
TEST(Twins, WhichTakeEachOthersPlaceAreBothSaid) {
  std::mt19937_64 random{test::seed()};
  int named = 0;
  for (int campaign = 0; campaign < 24; ++campaign) {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(8, 8), .channels = 4, .sigma = 0.004, .session_ratio = 0.3},
        random);
    test::add_covariate(o, "time_since_motor_start_s", 5, 400, random);
    const std::string truth = campaign % 2 == 0 ? "creep" : "wake_recirculation";
    test::add_effect(o, truth, {0.02, 300});
    const Explanation e = explained(o);
    for (const AdoptedEffect& adopted : e.adopted) {
      const std::string& name = adopted.term.effect->name;
      if (adopted.term.rotor >= 0 || (name != "creep" && name != "wake_recirculation")) continue;
      ++named;
      EXPECT_TRUE(name == truth || std::ranges::count(adopted.confounded_with, truth) == 1)
          << "campaign " << campaign << " of " << truth << "\n"
          << explanation_text(e);
    }
  }
  EXPECT_GE(named, 12);
}

/// With a time constant that may be anything the formula says nothing.
TEST_F(Refuted, ANameOfWhichTheTimeConstantIsNotKnownIsNone) {
  const Observations o = test::four_rotors(3, 0.002, random);
  const Effect& creep = test::effect_named("creep");
  const EffectParameter& bounds = creep.parameters[1];
  const auto with_interval = [&](double low, double high) {
    return AdoptedEffect{.term = {.effect = &creep, .parameters = {0.02, 100}},
                         .parameters = {{.name = "amplitude", .value = 0.02, .low = 0.01, .high = 0.03},
                                        {.name = "time_constant", .value = 100, .low = low, .high = high}},
                         .confounded_with = {},
                         .separating_run = {}};
  };
  EXPECT_EQ(refutation(with_interval(20, bounds.upper), o), "");
  EXPECT_EQ(refutation(with_interval(bounds.lower, 300), o), "");
  EXPECT_THAT(refutation(with_interval(bounds.lower, bounds.upper), o),
              HasSubstr("time_constant may be anything"));
}

TEST_F(Refuted, WhatGoesWithTheForceAloneIsSaidToBendOverIt) {
  const Observations o = observed("y\n1\n2\n", "[response]\ncolumn = \"y\"\nunit = \"N\"\n");
  AdoptedEffect offset{.term = {.effect = &test::effect_named("zero_offset"), .parameters = {0.02}},
                       .parameters = {{.name = "offset", .value = 0.02, .low = 0.01, .high = 0.03}},
                       .confounded_with = {},
                       .separating_run = {}};
  EXPECT_EQ(refutation(offset, o), "");
  offset.bends_away = true;
  EXPECT_THAT(refutation(offset, o), HasSubstr("goes with the force bends away"));
}

/// Of a state that nobody has seen a formula says nothing, where a straight line fits as well.
TEST_F(Refuted, ATimeConstantBeyondTheTimesThatWereSeenIsNone) {
  Observations o = test::four_rotors(3, 0.002, random);
  test::add_covariate(o, std::string(kTimeSinceMotorStart), 5, 290, random);
  o.duration_s.setConstant(10);
  const Effect& warm_up = test::effect_named("motor_warm_up");
  const auto with_constant = [&](double low, double value, double high) {
    return AdoptedEffect{.term = {.effect = &warm_up, .parameters = {0.02, value}},
                         .parameters = {{.name = "amplitude", .value = 0.02, .low = 0.01, .high = 0.03},
                                        {.name = "time_constant", .value = value, .low = low, .high = high}},
                         .confounded_with = {},
                         .separating_run = {}};
  };
  EXPECT_EQ(refutation(with_constant(50, 280, 900), o), "");
  EXPECT_EQ(refutation(with_constant(200, 400, 600), o), "");
  for (const AdoptedEffect& line : {with_constant(20, 400, 1300), with_constant(7200, 7200, 7200)})
    EXPECT_THAT(refutation(line, o), HasSubstr("of which no run shows more than"))
        << line.parameters[1].value;
}

/// A thrust that goes on falling for as long as the motors turn: whatever its time constant, it is beyond.
TEST_F(Refuted, AStraightLineInTimeIsNoExponential) {
  int line = 0;
  for (int campaign = 0; campaign < 6; ++campaign) {
    Observations o = test::four_rotors(3, 0.002, random);
    test::add_covariate(o, std::string(kTimeSinceMotorStart), 5, 300, random);
    const Eigen::VectorXd since_s = o.covariates.back().value.col(0);
    test::set_y(o, o.y.colwise() - 4e-5 * since_s);
    const Explanation e = explained(o);
    if (!e.adopted.empty()) continue;  // noise may bend a line
    ASSERT_EQ(e.unknown.size(), 1u) << explanation_text(e);
    EXPECT_EQ(e.unknown[0].covariate, kTimeSinceMotorStart);
    ++line;
  }
  EXPECT_GE(line, 5);
}

}  // namespace
}  // namespace tunnelrig
