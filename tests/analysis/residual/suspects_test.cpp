// Runs whose conditions were mistyped, and rows whose responses were.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/explanation/seal.h"
#include "analysis/residual/simulated.h"
#include "analysis/residual/tables.h"
#include "support/seeds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::UnorderedElementsAreArray;

struct Mistyped : testing::Test {
  std::mt19937_64 random{test::seed()};
  Observations campaign = with_supply();

  /// A supply voltage does 1 % a volt.
  Observations with_supply() {
    Observations o = test::four_rotors(4, 0.002, random);
    const Covariate& volts = *o.find("supply_voltage_V");
    test::set_y(o, o.y.colwise() + 0.01 * (volts.value.col(0).array() - 16).matrix());
    return o;
  }
  double& volts(Eigen::Index run) {
    for (Covariate& covariate : campaign.covariates)
      if (covariate.name == "supply_voltage_V") return covariate.value(run, 0);
    throw std::logic_error("no supply");
  }
};

TEST_F(Mistyped, AConditionIsSetAsideAndHidesNothing) {
  volts(70) = 1.6;
  const Explanation e = test::explained(campaign);
  ASSERT_EQ(e.adopted.size(), 1u) << explanation_text(e);
  EXPECT_EQ(e.adopted[0].term.effect->name, "supply_voltage");
  ASSERT_EQ(e.suspect_rows.size(), 1u);
  EXPECT_EQ(e.suspect_rows[0].row, campaign.name[70]);
  EXPECT_TRUE(e.suspect_rows[0].set_aside);
  EXPECT_THAT(e.warnings,
              Contains(HasSubstr("supply_voltage_V of " + campaign.name[70] + " is 1.6, far from")));
}

TEST_F(Mistyped, ATemperatureIsASlipWhereTheDensityPutTheThrustFarOff) {
  test::add_covariate(campaign, "air_temperature_C", 18, 24, random);
  campaign.covariates.back().value(70, 0) = 4;
  EXPECT_TRUE(mistyped_values(campaign).empty()) << "a cold day";
  Eigen::MatrixXd y = campaign.y;
  y.row(70).array() += 0.06;
  test::set_y(campaign, y);
  ASSERT_EQ(mistyped_values(campaign).size(), 1u);
  EXPECT_EQ(mistyped_values(campaign)[0].row, campaign.name[70]);
}

/// The run that would tell two effects apart, as `separating_run` proposes it.
TEST_F(Mistyped, ARunUnderOtherConditionsOnPurposeIsNone) {
  volts(70) = 24;
  Eigen::MatrixXd y = campaign.y;
  y.row(70).array() += 0.08;
  test::set_y(campaign, y);
  EXPECT_TRUE(mistyped_values(campaign).empty());
}

TEST_F(Mistyped, GapsOfADistanceAreNoValues) {
  volts(70) = 1.6;
  for (const Eigen::Index run : {3, 9, 40}) volts(run) = std::numeric_limits<double>::infinity();
  ASSERT_EQ(isolated_values(campaign).size(), 1u);
  EXPECT_GT(isolated_values(campaign)[0].low, 10);
}

struct GrossRowsTest : test::TablesTest {
  std::string csv;
  std::vector<std::string> lines;  // of the rows that are wrong

  /// Thrust over speed with a Reynolds number's 0.1 and 1 % of scatter; each of `wrong` multiplies one of the
  /// fastest rows, one of five.
  void write_thrusts(const std::vector<double>& wrong, int blocks = 12) {
    std::vector<double> rpm(96);
    for (double& each : rpm) each = 2000 + 6000 * even(random);
    std::vector<std::size_t> fastest(rpm.size());
    std::iota(fastest.begin(), fastest.end(), 0U);
    std::sort(fastest.begin(), fastest.end(), [&](std::size_t a, std::size_t b) { return rpm[a] > rpm[b]; });
    std::vector<double> factor(rpm.size(), 1);
    for (std::size_t k = 0; k < wrong.size(); ++k) {
      factor[fastest[5 * k + 1]] = wrong[k];
      lines.push_back(fmt::format("t.csv:{}", fastest[5 * k + 1] + 2));
    }
    csv = "b,N,y\n";
    for (std::size_t r = 0; r < rpm.size(); ++r)
      csv += fmt::format("{},{:.1f},{:.5f}\n", static_cast<int>(r) % blocks, rpm[r],
                         6 * std::pow(rpm[r] / 5000, 2.1) * (1 + 0.01 * scatter(random)) * factor[r]);
  }
  Explanation explained(const std::string& more = "") const {
    return test::explained(
        observed(csv, "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n" + more +
                          "meaning = \"thrust_N\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n"
                          "[propeller]\ndiameter_m = 0.2\n"));
  }
  static std::vector<std::string> set_aside(const Explanation& e) {
    std::vector<std::string> rows;
    for (const SuspectRow& row : e.suspect_rows)
      if (row.set_aside) rows.push_back(row.row);
    return rows;
  }
};

/// A few gross rows at high speed look like scatter that grows with the speed.
TEST_F(GrossRowsTest, AreNotTakenForScatterThatGoesWithTheSpeed) {
  write_thrusts({1.5, 1.6, 1.4});
  const Explanation e = explained();
  EXPECT_THAT(set_aside(e), UnorderedElementsAreArray(lines)) << explanation_text(e);
  EXPECT_EQ(e.adopted.size(), 1u) << explanation_text(e);
}

/// An error that leaves some of the rows out that were held out for it says so.
TEST_F(GrossRowsTest, OfSealedBlocksAreSaidToBeInNoError) {
  int with = 0;
  for (const double wrong : {1.5, 1.7, 2.0, 3.0}) {
    lines.clear();
    write_thrusts({wrong});
    const Explanation e = explained();
    ASSERT_THAT(set_aside(e), UnorderedElementsAreArray(lines)) << explanation_text(e);
    const int block = (std::stoi(lines[0].substr(lines[0].find(':') + 1)) - 2) % 12;
    csv = csv.substr(0, csv.find('\n') + 1);  // the same blocks, whose rows do not matter
    for (int r = 0; r < 96; ++r) csv += fmt::format("{},{},{}\n", r % 12, 2000 + r, 1 + r % 3);
    const Observations o = observed(csv, "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n");
    const std::vector<int> sealed = seal_blocks(o, test::quick().seed).sealed;
    const bool is_sealed = std::ranges::any_of(sealed, [&](int row) { return row % 12 == block; });
    const auto said = Contains(HasSubstr("1 of the rows that are set aside is held out"));
    if (is_sealed)
      EXPECT_THAT(e.warnings, said);
    else
      EXPECT_THAT(e.warnings, testing::Not(said));
    with += is_sealed ? 1 : 0;
  }
  EXPECT_GT(with, 0);
}

/// An error that one block makes has no interval.
TEST_F(GrossRowsTest, OfAWildBlockMakeNoInterval) {
  const auto explained_with = [&](double wild) {
    csv = "b,y\n";
    for (int r = 0; r < 80; ++r)
      csv += fmt::format("{},{}\n", r / 10, 5 + 0.01 * scatter(random) * std::pow(wild, r / 10));
    return test::explained(observed(csv, "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"));
  };
  const auto said = Contains(HasSubstr("the interval of the error before says nothing"));
  const Explanation calm = explained_with(1), wild = explained_with(6);
  EXPECT_THAT(calm.warnings, testing::Not(said));
  EXPECT_THAT(wild.warnings, said) << explanation_text(wild);
}

TEST_F(GrossRowsTest, AreAllSetAsideWhereEachHidesTheNext) {
  write_thrusts({1000, 40, 2});
  const Explanation e = explained("scatter = \"absolute\"\n");
  EXPECT_THAT(set_aside(e), UnorderedElementsAreArray(lines)) << explanation_text(e);
}

TEST_F(GrossRowsTest, AreFoundInTooFewBlocksForAnEffect) {
  write_thrusts({1.5}, 4);
  const Explanation e = explained();
  EXPECT_EQ(e.verdict, "insufficient");
  EXPECT_THAT(set_aside(e), UnorderedElementsAreArray(lines)) << explanation_text(e);
}

/// Rows of held-out blocks, as far from what is predicted for them as `error` says.
struct HeldOutRows : testing::Test {
  std::mt19937_64 random{test::seed()};
  Observations table = test::simulate({.runs_of_block = std::vector<int>(10, 8)}, random);
  HeldOutErrors sealed;
  MeanModel model;

  HeldOutRows() {
    table.from_table = true;
    sealed.rows = table.all_rows();
    sealed.error = Eigen::MatrixXd::Zero(table.rows(), 1);
    for (double& error : sealed.error.reshaped()) error = std::normal_distribution<double>(0, 0.01)(random);
  }
  std::vector<std::string> apart() const {
    std::vector<std::string> rows;
    for (const SuspectRow& row : apart_from_their_block(table, model, sealed)) rows.push_back(row.row);
    return rows;
  }
};

TEST_F(HeldOutRows, AreWrongWhereTheRestOfTheirBlockIsRight) {
  EXPECT_THAT(apart(), testing::IsEmpty());
  sealed.error(17, 0) = 0.9;
  EXPECT_THAT(apart(), testing::ElementsAre(table.name[17]));
  table.held_out.assign(80, true);
  EXPECT_THAT(apart(), testing::IsEmpty()) << "what is held out by name may be beyond any model";
  table.held_out.clear();
  table.blocks_are_rows = true;
  EXPECT_THAT(apart(), testing::IsEmpty()) << "nothing else is in its block";
}

/// A turbine's six runs at its lowest speed, where it gives nothing like the rest, and of others two.
TEST(RepeatedRows, AreAConditionAndNoErrors) {
  std::mt19937_64 random{test::seed()};
  Observations table = test::simulate({.runs_of_block = std::vector<int>(12, 6)}, random);
  table.from_table = true;
  test::add_covariate(table, "tow_speed", 0.4, 1.2, random);
  std::vector<SuspectRow> suspects;
  for (const std::size_t row : {3U, 4U, 5U, 40U, 41U, 42U}) {
    table.covariates.back().value(static_cast<Eigen::Index>(row), 0) = 0.2;
    suspects.push_back({.row = table.name[row], .studentised = -80});
  }
  const SuspectRow alone{.row = table.name[20], .studentised = 30};
  suspects.push_back(alone);
  ASSERT_EQ(gross_rows(table, suspects).size(), 1u);
  EXPECT_EQ(gross_rows(table, suspects)[0].row, alone.row);
  suspects[0].studentised = suspects[1].studentised = 80;
  suspects[2].studentised = suspects[3].studentised = 80;
  EXPECT_EQ(gross_rows(table, suspects).size(), 3u) << "the two on the other side repeat nothing";
}

/// A curve stays as it was at its end, and what it is over may do more.
TEST_F(HeldOutRows, AreNotWrongBeyondWhatACurveHasSeen) {
  sealed.error(17, 0) = 0.9;
  Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(table.rows(), 0, 1);
  model.curves.push_back({.covariate = "x", .columns = {}, .x = x, .low = 0, .high = 1});
  EXPECT_THAT(apart(), testing::ElementsAre(table.name[17]));
  model.curves[0].x(17, 0) = 1.1;
  EXPECT_THAT(apart(), testing::IsEmpty());
}

TEST_F(HeldOutRows, AreNotWrongWhereTheirBlockIsElsewhere) {
  for (int row = 16; row < 24; ++row) sealed.error(row, 0) = 0.9;
  EXPECT_THAT(apart(), testing::IsEmpty());
  sealed.error.middleRows(18, 6).setConstant(0.01);
  EXPECT_THAT(apart(), testing::IsEmpty()) << "two of eight";
}

/// None is as far off as a single one must be, but both are apart.
TEST_F(Mistyped, SeveralRunsThatAreApartAreSetAsideTogether) {
  Observations o = test::four_rotors(4, 0.002, random);
  constexpr std::array<std::pair<int, double>, 2> kOff = {{{9, 0.022}, {70, -0.018}}};
  Eigen::MatrixXd y = o.y;
  for (const auto& [run, off] : kOff) y.row(run).array() += off;
  test::set_y(o, y);
  std::vector<std::string> aside, off;
  for (const SuspectRow& row : test::explained(o).suspect_rows)
    if (row.set_aside) aside.push_back(row.row);
  for (const auto& [run, size] : kOff) off.push_back(o.name[static_cast<std::size_t>(run)]);
  EXPECT_THAT(aside, UnorderedElementsAreArray(off));
}

TEST_F(Mistyped, ManyRunsThatAreFarOffStayAndAreSaid) {
  Observations o = test::four_rotors(4, 0.002, random);
  Eigen::MatrixXd y = o.y;
  for (const int run : {9, 31, 52, 70, 88, 110}) y.row(run).array() += run % 2 == 0 ? 0.05 : -0.04;
  test::set_y(o, y);
  const Explanation e = test::explained(o);
  EXPECT_FALSE(std::ranges::any_of(e.suspect_rows, &SuspectRow::set_aside));
  EXPECT_THAT(e.warnings, Contains(HasSubstr("6 runs are far off, more than are set aside (5 at most)")));
}

struct LoneRows : test::TablesTest {
  /// Thrusts by voltage, one of them at 6 V; `factor` multiplies that.
  Explanation explained(double factor) {
    std::string csv = "b,V,y\n";
    for (int r = 0; r < 96; ++r) {
      const double volts = r == 22 ? 6 : 10.5 + 2 * even(random);
      csv += fmt::format("{},{},{}\n", r / 8, volts,
                         (r == 22 ? factor : 1) * 8 * std::pow(volts / test::kMiddle_V, 1.7) *
                             (1 + 0.003 * scatter(random)));
    }
    return test::explained(
        observed(csv,
                 "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                 "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"));
  }
};

/// The baseline leaves it as far from all others as a typing error.
TEST_F(LoneRows, ThatTheEffectsOfTheOthersPredictStay) {
  const Explanation e = explained(1);
  EXPECT_EQ(names(e), "supply_voltage ");
  EXPECT_FALSE(std::ranges::any_of(e.suspect_rows, &SuspectRow::set_aside)) << explanation_text(e);
  EXPECT_EQ(e.runs, 96);
}

TEST_F(LoneRows, ThatTheyDoNotPredictAreSetAside) {
  const Explanation e = explained(3);
  EXPECT_EQ(names(e), "supply_voltage ");
  ASSERT_EQ(std::ranges::count_if(e.suspect_rows, &SuspectRow::set_aside), 1) << explanation_text(e);
  EXPECT_EQ(e.suspect_rows[0].row, "t.csv:24");
}

/// What is left has to differ, and to have a row that the table holds out.
TEST_F(LoneRows, ThatAllRestsUponStay) {
  std::string csv = "b,held,y\n";
  for (int r = 0; r < 96; ++r)
    csv +=
        fmt::format("{},{},{}\n", r / 8, r == 22 ? 1 : 0, (r == 22 ? 30 : 8) * (1 + 0.003 * scatter(random)));
  const std::string response = "[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n";
  Explanation e = test::explained(observed(csv, "blocks = \"b\"\nhold_out = \"held == 1\"\n" + response));
  EXPECT_FALSE(std::ranges::any_of(e.suspect_rows, &SuspectRow::set_aside)) << explanation_text(e);
  EXPECT_GT(e.before.held_out_rmse, 10);
  csv = "b,y\n";
  for (int r = 0; r < 96; ++r) csv += fmt::format("{},{}\n", r / 8, r == 22 ? 30 : 8);
  e = test::explained(observed(csv, "blocks = \"b\"\n" + response));
  EXPECT_EQ(e.runs, 96);
}

}  // namespace
}  // namespace tunnelrig
