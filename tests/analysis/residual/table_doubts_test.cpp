// What of a table is doubtful is said: blocks that are wrong, motors that stand under load, tares beside two
// directions, errors beyond their floor.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/tables.h"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

struct TableDoubts : test::TablesTest {
  static constexpr const char* kTorques =
      "blocks = \"set\"\n[response]\ncolumn = \"y\"\nunit = \"N m\"\n"
      "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n";
  static constexpr const char* kThrustAndSpeed =
      "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
      "[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n";

  /// 20 sets of 8 torques; the first `wrong` of set 6 are a tenth too large.
  std::string torques(int wrong) {
    std::string csv = "set,T,y\n";
    for (int r = 0; r < 160; ++r)
      csv += fmt::format("{},{},{}\n", r / 8, 20 + scatter(random),
                         (r / 8 == 6 && r % 8 < wrong ? 1.1 : 1) * 3 * (1 + 0.002 * scatter(random)));
    return csv;
  }
};

/// What is left of such a block is judged as if it were right.
TEST_F(TableDoubts, ABlockOfWhichMostIsSetAside) {
  EXPECT_THAT(
      explained(observed(torques(6), kTorques)).warnings,
      Contains(HasSubstr("6 of the 8 rows of block 6 are set aside, and the rest is likely as wrong")));
  const Explanation few = explained(observed(torques(2), kTorques));
  EXPECT_EQ(few.suspect_rows.size(), 2u);
  EXPECT_THAT(few.warnings, Not(Contains(HasSubstr("the rest is likely as wrong"))));
}

/// A speed in thousands of rev/min stands beside others in rev/min.
TEST_F(TableDoubts, AMotorThatStandsUnderLoad) {
  std::string csv = "b,N,y\n";
  for (int r = 0; r < 96; ++r) {
    const double rpm = 3000 + 4000 * even(random);
    csv += fmt::format("{},{},{}\n", r / 8, r % 8 == 3 ? rpm / 1000 : rpm,
                       6 * std::pow(rpm / 5000, 2) * (1 + 0.003 * scatter(random)));
  }
  EXPECT_THAT(observed(csv, kThrustAndSpeed).left_out,
              Contains(AllOf(HasSubstr("12 rows left out: the motor stood"), HasSubstr("another unit?"))));
  csv = "b,N,y\n";
  for (int r = 0; r < 96; ++r) {
    const double rpm = r % 8 == 3 ? 0 : 3000 + 4000 * even(random);
    csv += fmt::format("{},{},{}\n", r / 8, rpm, 6 * std::pow(rpm / 5000, 2) + 0.01 * scatter(random));
  }
  EXPECT_THAT(observed(csv, kThrustAndSpeed).left_out, Contains(Not(HasSubstr("another unit?"))));
}

/// The constant is held against a C_T of either direction: their difference is no tare.
TEST_F(TableDoubts, ATareBesideThrustsOfBothDirections) {
  for (const double tare_N : {0.0, -0.4}) {
    std::string csv = "b,N,y\n";
    for (int r = 0; r < 96; ++r) {
      const double rpm = 1000 + 6000 * even(random), full_N = 6 * std::pow(rpm / 5000, 2);
      csv += fmt::format("{},{},{}\n", r / 8, rpm,
                         (r % 2 == 0 ? full_N : -0.75 * full_N) + tare_N + 0.02 * scatter(random));
    }
    const Explanation e = explained(observed(csv, kThrustAndSpeed));
    EXPECT_THAT(e.warnings, Contains(HasSubstr("thrusts of both directions")));
    const auto of_tare = Contains(HasSubstr("a constant beside C_T, -0."));
    if (tare_N == 0)
      EXPECT_THAT(e.warnings, Not(Contains(HasSubstr("a constant beside C_T")))) << explanation_text(e);
    else
      EXPECT_THAT(e.warnings, of_tare) << explanation_text(e);
  }
}

/// A floor of seven residuals is known to a third: an error above it is mostly chance.
TEST_F(TableDoubts, AFewRowsTellAFloorAsWellAsTheyCan) {
  constexpr int kTables = 80;
  int beyond = 0;
  for (int i = 0; i < kTables; ++i) {
    std::string csv = "T,y\n";
    for (int r = 0; r < 12; ++r)
      csv += fmt::format("{},{}\n", 20 + scatter(random), 3 * (1 + 0.01 * scatter(random)));
    const Explanation e = explained(
        observed(csv,
                 "blocks = \"rows\"\n[response]\ncolumn = \"y\"\nunit = \"N m\"\n"
                 "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n"));
    beyond += e.sealed.beyond_floor ? 1 : 0;
  }
  EXPECT_LE(beyond, 5) << "binomial (80, 0.02): beyond 5 in 0.7 % of cases";
}

/// Where a few rows are all of the error, its interval reaches as far as any floor.
TEST(Doubts, AFloorFarAboveTheErrorIsSaid) {
  const auto warnings_at = [](double floor, double held_out_high) {
    Explanation e;
    e.noise_floor = floor;
    e.before.held_out_rmse = e.after.held_out_rmse = 1;
    e.after.held_out_high = held_out_high;
    warn_of_doubts(e);
    return e.warnings;
  };
  EXPECT_THAT(warnings_at(60, 100), Contains(HasSubstr("the noise floor is 60 times the error")));
  EXPECT_THAT(warnings_at(1.5, 1.4), Contains(HasSubstr("above all of the error's interval")));
  EXPECT_THAT(warnings_at(1.5, 100), testing::Not(Contains(HasSubstr("floor"))));
}

/// Only what was held out had another oil.
TEST_F(TableDoubts, AConditionThatTheOpenRowsDoNotShowIsSaid) {
  std::string csv = "set,oil,y\n";
  for (int r = 0; r < 96; ++r)
    csv += fmt::format("{},{},{}\n", r / 8, r > 71 && r % 2 == 0 ? 2 : 1, 3 * (1 + 0.01 * scatter(random)));
  const Explanation e = explained(
      observed(csv,
               "blocks = \"set\"\nhold_out = \"set > 8\"\n[response]\ncolumn = \"y\"\nunit = \"N m\"\n"
               "[[covariates]]\ncolumn = \"oil\"\nunit = \"1\"\n"));
  EXPECT_THAT(e.warnings, Contains(HasSubstr("oil is the same in every open row: nothing can be found")));
}

/// One gust in which one row is far off tells nothing of what wind does, whichever rows are held out.
TEST_F(TableDoubts, OneRunFarOutOnACondition) {
  constexpr int kTables = 12;
  for (const bool held_out_first : {true, false}) {
    int found = 0;
    for (int i = 0; i < kTables; ++i) {
      std::string csv = "set,w,y\n";
      for (int r = 0; r < 96; ++r) {
        const bool gust = r == 60;
        csv += fmt::format("{},{},{}\n", r / 8, gust ? 9 : even(random),
                           3 * (1 + 0.01 * (gust ? 8 : scatter(random))));
      }
      const Explanation e = explained(observed(csv, "blocks = \"set\"\nhold_out = \"" +
                                                        std::string(held_out_first ? "set < 3" : "set > 8") +
                                                        "\"\n[response]\ncolumn = \"y\"\nunit = \"N m\"\n"
                                                        "[[covariates]]\ncolumn = \"w\"\nunit = \"1\"\n"));
      found += e.adopted.empty() && e.unknown.empty() ? 0 : 1;
    }
    EXPECT_LE(found, 2) << (held_out_first ? "the first are held out" : "the last are held out");
  }
}

/// A day on which all was larger had another level, and from one day to the next nothing goes with it.
TEST_F(TableDoubts, WhatOneBlockAloneShowsIsNoDependence) {
  const auto of = [&](int special_days) {
    std::string csv = "day,level,y\n";
    for (int r = 0; r < 192; ++r) {
      const bool special = r / 12 >= 7 && r / 12 < 7 + special_days;
      csv += fmt::format("{},{},{}\n", r / 12, (special ? 12.3 : 11.1) + 0.03 * scatter(random),
                         (special ? 10.4 : 10.0) + 0.05 * scatter(random));
    }
    return explained(observed(csv,
                              "blocks = \"day\"\n[response]\ncolumn = \"y\"\nunit = \"1\"\n"
                              "[[covariates]]\ncolumn = \"level\"\nunit = \"1\"\n"));
  };
  constexpr int kTables = 12;
  int claimed = 0, said = 0;  // the others show it by chance once in twenty
  for (int k = 0; k < kTables; ++k) {
    const Explanation one = of(1), three = of(3);
    claimed += !one.unknown.empty();
    said += testing::Matches(Contains(HasSubstr("block 7 alone shows that the response goes with level")))(
        one.warnings);
    ASSERT_EQ(three.unknown.size(), 1u) << explanation_text(three);
    EXPECT_EQ(three.unknown[0].covariate, "level");
    EXPECT_THAT(three.warnings, Not(Contains(HasSubstr("alone shows"))));
  }
  EXPECT_LE(claimed, 3);
  EXPECT_GE(said, kTables - 4);
}

/// Days that differ by 0.3 %, and one that was something else.
TEST(Doubts, ABlockFarFromTheOthersIsNamed) {
  std::mt19937_64 random{test::seed()};
  Observations o = test::four_rotors(4, 0.002, random);
  EXPECT_THAT(explained(o).warnings, testing::Not(Contains(HasSubstr("let expect"))));
  Eigen::MatrixXd y = o.y;
  for (Eigen::Index run = 0; run < o.rows(); ++run) {
    if (o.block[static_cast<std::size_t>(run)] == 5) y.row(run).array() += 0.05;
    if (o.block[static_cast<std::size_t>(run)] == 9) y(run, 2) -= 0.06;
  }
  test::set_y(o, y);
  const Explanation e = explained(o);
  EXPECT_THAT(e.warnings, Contains(testing::AllOf(HasSubstr("session " + o.block_name[5] + " is"),
                                                  HasSubstr("% above what the others let expect"))));
  EXPECT_THAT(e.warnings, Contains(testing::AllOf(HasSubstr("rotor 3 of session " + o.block_name[9] + " is"),
                                                  HasSubstr("% below what the others let expect"))));
}

/// A day of a single run scatters more than days of twenty.
TEST(Doubts, ABlockOfOneRunIsNoOddOne) {
  constexpr int kCampaigns = 200;
  std::mt19937_64 random{test::seed()};
  std::normal_distribution<double> normal;
  std::vector<int> runs(16, 20);
  runs[3] = runs[9] = 1;
  const Observations o = test::simulate({.runs_of_block = runs}, random);
  int named = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Explanation e;
    e.residual_after = o.value;
    for (double& each : e.residual_after.reshaped()) each *= 0.01 * normal(random);
    warn_of_odd_blocks(o, e);
    named += e.warnings.empty() ? 0 : 1;
  }
  EXPECT_LE(named, 2);
}

}  // namespace
}  // namespace tunnelrig
