// The search done once more when the seal is open: what the open blocks are too few to show, and what they
// named wrongly.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;
using testing::Contains;
using testing::HasSubstr;

struct AllBlocks : testing::Test {
  std::mt19937_64 random{test::seed()};

  Observations campaign(double session_ratio) {
    return test::simulate(
        {.runs_of_block = std::vector<int>(16, 8), .channels = 4, .session_ratio = session_ratio}, random);
  }

  /// The same in all runs of a session.
  Eigen::VectorXd of_sessions(Observations& o, const std::string& name, double low, double high) {
    test::add_covariate(o, name, low, high, random);
    Eigen::MatrixXd& value = o.covariates.back().value;
    for (Eigen::Index r = 0; r < o.rows(); ++r) value(r, 0) = value(8 * (r / 8), 0);
    return value.col(0);
  }

  /// With what it does: as theory says, or something else.
  void add_pressure(Observations& o, bool as_theory_says) {
    const Eigen::VectorXd pressure = of_sessions(o, "air_pressure_Pa", 100700, 101900);
    const Eigen::ArrayXd s = (pressure.array() - 101300) / 600;
    if (as_theory_says)
      test::add_effect(o, "air_pressure", {1});
    else
      test::set_y(o, o.y + 0.006 * s.square().matrix().replicate(1, 4));
  }
};

/// What varies with the session is seen in few values, of which the seal takes a quarter.
TEST_F(AllBlocks, WhatTheyAloneShowIsUnknownAndNotScored) {
  int of_all = 0, of_open = 0;
  for (int number = 0; number < 12; ++number) {
    Observations o = campaign(0.3);
    const Eigen::VectorXd heating = of_sessions(o, "hall_heating_kW", 0, 30);
    test::set_y(o, o.y + 0.0013 * (heating.array() / 30 * 6.28).cos().matrix().replicate(1, 4));
    const Explanation e = explained(o);
    if (e.unknown.empty() || e.unknown[0].covariate != "hall_heating_kW") continue;
    if (!e.unknown[0].by_sealed_too) {
      ++of_open;
      continue;
    }
    ++of_all;
    EXPECT_EQ(e.by_sealed_too.size(), e.unknown.size());
    EXPECT_TRUE(e.model.curves.empty());
    EXPECT_NEAR(e.unknown[0].amplitude, 0.0013 * 7, 0.6 * 0.0013 * 7);
    EXPECT_EQ(e.after.held_out_rmse, e.before.held_out_rmse);
    EXPECT_THAT(explanation_text(e), HasSubstr("only with the sealed blocks in"));
    EXPECT_TRUE(e.unknown[0].could_be.empty()) << "no effect of the library goes with it";
  }
  EXPECT_GE(of_all, 1) << "and the open blocks alone " << of_open;
}

/// Where theory does as well as the curve it is said, though it comes too late to be scored; where the
/// condition does something else, no name is.
TEST_F(AllBlocks, WhatTheyShowMayHaveAName) {
  const auto curves_of = [&](bool as_theory_says) {
    Observations o = campaign(1);
    add_pressure(o, as_theory_says);
    const std::vector<int> rows = o.all_rows();
    SearchSettings nothing = test::quick();
    nothing.most_effects = nothing.most_curves = 0;
    const Attribution found = attribute(o, rows, {}, nothing);
    return structure_left(found, found.final, rows, test::every_effect(), test::quick()).curves;
  };
  const std::vector<FoundCurve> as_theory_says = curves_of(true), otherwise = curves_of(false);
  ASSERT_EQ(as_theory_says.size(), 1u);
  EXPECT_EQ(as_theory_says[0].curve.covariate, "air_pressure_Pa");
  ASSERT_EQ(as_theory_says[0].could_be.size(), 1u);
  EXPECT_EQ(as_theory_says[0].could_be[0].term.effect->name, "air_pressure");
  EXPECT_TRUE(as_theory_says[0].could_be[0].term.at_theory);
  ASSERT_EQ(otherwise.size(), 1u);
  EXPECT_EQ(otherwise[0].curve.covariate, "air_pressure_Pa");
  EXPECT_TRUE(otherwise[0].could_be.empty());
}

/// The same of a curve that the open blocks have shown, when they had no name for it.
TEST_F(AllBlocks, WhatTheOpenOnesShowMayHaveAName) {
  const auto names_of = [&](bool as_theory_says) {
    Observations o = campaign(0.3);
    add_pressure(o, as_theory_says);
    const std::vector<int> rows = o.all_rows();
    const Attribution found = attribute(o, rows, {}, test::quick());
    EXPECT_EQ(found.curves.size(), 1u);
    return structure_left(found, found.final, rows, test::every_effect(), test::quick()).names;
  };
  const auto as_theory_says = names_of(true), otherwise = names_of(false);
  ASSERT_EQ(as_theory_says.size(), 1u);
  ASSERT_EQ(as_theory_says[0].size(), 1u);
  EXPECT_EQ(as_theory_says[0][0].term.effect->name, "air_pressure");
  EXPECT_TRUE(as_theory_says[0][0].on_all_blocks);
  ASSERT_EQ(otherwise.size(), 1u);
  EXPECT_TRUE(otherwise[0].empty());
}

/// Two conditions that went together while the blocks were open, and do not in the sealed ones.
TEST_F(AllBlocks, WhatTheyTellApartIsNoSet) {
  Observations o = campaign(0.3);
  test::add_covariate(o, "supply_voltage_V", 11, 12.5, random);
  const Eigen::VectorXd volts = o.covariates.back().value.col(0);
  test::add_covariate(o, "cell_temperature_C", 10, 30, random);
  std::vector<int> open;
  for (int row = 0; row < 96; ++row) {
    o.covariates.back().value(row, 0) = 20 + 100 * std::log(volts(row) / 11.7);
    open.push_back(row);
  }
  test::add_effect(o, "supply_voltage", {0.5});
  const Attribution found = attribute(o, open, test::every_effect(), test::quick());
  ASSERT_EQ(found.accepted.size(), 1u);
  const std::vector<Ranked>& set = found.accepted[0].confounded;
  ASSERT_FALSE(set.empty());
  const std::vector<int> rows = o.all_rows();
  const StructureLeft left = structure_left(found, fit_jointly(o, found.final.model, rows), rows,
                                            test::every_effect(), test::quick());
  ASSERT_EQ(left.confounded.size(), 1u);
  if (found.accepted[0].term.effect->name == "supply_voltage")
    EXPECT_TRUE(left.confounded[0].empty());
  else
    EXPECT_TRUE(std::ranges::any_of(left.confounded[0], [](const Ranked& rival) {
      return rival.term.effect->name == "supply_voltage";
    })) << "a rival that does better";
}

/// What a rotor does above a temperature and not below is half a line: few sessions do not show its other
/// half, all of them do.
TEST_F(AllBlocks, AFormulaThatItsOwnConditionBendsAwayFromIsTakenBack) {
  int taken_back = 0, named = 0, of_line = 0;
  const auto with_line = [&](bool kink) {
    Observations o = campaign(0.3);
    const Eigen::VectorXd supply = of_sessions(o, "supply_voltage_V", 15.5, 16.5);
    const Eigen::ArrayXd over = supply.array() - 16;
    Eigen::MatrixXd y = o.y;
    y.colwise() += 0.004 * (kink ? 2 * over.max(0) : over).matrix();
    test::set_y(o, y);
    return explained(o);
  };
  for (int number = 0; number < 12; ++number) {
    const Explanation e = with_line(true);
    if (!e.adopted.empty()) ++named;
    if (testing::Value(e.warnings, Contains(HasSubstr("supply_voltage_V bends away from its formula")))) {
      ++taken_back;
      EXPECT_EQ(e.verdict, "unknown") << explanation_text(e);
      EXPECT_EQ(e.unknown.at(0).covariate, "supply_voltage_V");
    }
    if (number % 3 == 0) of_line += with_line(false).adopted.size() == 1;
  }
  EXPECT_GE(taken_back, 1);
  EXPECT_LE(named, 8);
  EXPECT_GE(of_line, 3) << "of 4: what follows the formula keeps its name";
}

TEST_F(AllBlocks, ShowNothingWhereNothingIs) {
  int unknown = 0;
  for (int number = 0; number < 30; ++number) {
    Observations o =
        test::simulate({.runs_of_block = std::vector<int>(16, 6), .channels = 4, .session_ratio = 1}, random);
    for (const char* name : {"hall_heating_kW", "cable_slack_mm"})
      test::add_covariate(o, name, 0, 30, random);
    if (!explained(o).unknown.empty()) ++unknown;
  }
  EXPECT_LE(unknown, 4) << "two tests at 2 %: beyond 4 of 30 once in a hundred at 4 %";
}

}  // namespace
}  // namespace tunnelrig
