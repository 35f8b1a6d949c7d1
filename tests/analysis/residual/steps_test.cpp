// Steps: where they are, and what is none.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/likelihood/candidates.h"
#include "analysis/residual/search/step_profile.h"
#include "analysis/residual/tables.h"

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

struct Steps : test::TablesTest {
  /// Runs of four rotors in 16 sessions, with their order as a condition.
  Observations ordered() {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(16, 8), .channels = 4, .sigma = 0.002, .session_ratio = 0.1},
        random);
    Covariate order{"run_order", Eigen::VectorXd::LinSpaced(o.rows(), 0, static_cast<double>(o.rows() - 1)),
                    true};
    o.covariates.push_back(order);
    return o;
  }

  static std::string names(const Explanation& e) {
    std::string all;
    for (const AdoptedEffect& adopted : e.adopted) all += adopted.term.label() + "; ";
    return all;
  }

  /// In y, from a run on.
  static void step(Observations& o, Index first, Index rotor, double size) {
    MatrixXd y = o.y;
    y.bottomRows(y.rows() - first).col(rotor).array() += size;
    test::set_y(o, y);
  }
};

TEST_F(Steps, AGradualChangeIsNoStep) {
  Observations o = ordered();
  Eigen::MatrixXd y = o.y;
  for (Eigen::Index row = 0; row < y.rows(); ++row)
    y.row(row).array() -= 0.012 * std::pow(static_cast<double>(row) / static_cast<double>(y.rows()), 2.5);
  test::set_y(o, y);
  const Explanation e = explained(o);
  EXPECT_EQ(names(e), "");
  EXPECT_EQ(e.verdict, "unknown");
}

TEST_F(Steps, ASlowWaveIsNoStep) {
  Observations o = ordered();
  const VectorXd along = VectorXd::LinSpaced(o.rows(), 0, 2 * std::numbers::pi);
  MatrixXd y = o.y;
  y.colwise() += 0.004 * along.array().sin().matrix();
  test::set_y(o, y);
  const Explanation e = explained(o);
  EXPECT_EQ(names(e), "");
  ASSERT_FALSE(e.unknown.empty()) << explanation_text(e);
  EXPECT_EQ(e.unknown[0].covariate, "run_order");
}

/// A fan that is switched makes the runs scatter by as much as the step, until its curve is in: only then can
/// be seen where the step is.
TEST_F(Steps, IsPlacedAnewBesideACurve) {
  Observations o = ordered();
  const Index first = 8 * 8 + 3;
  for (Index rotor = 0; rotor < 4; ++rotor) step(o, first, rotor, 0.012);
  std::bernoulli_distribution coin(0.5);
  Covariate fan{"fan_on", Eigen::VectorXd(o.rows())};
  for (Index row = 0; row < o.rows(); ++row) fan.value(row, 0) = coin(random) ? 1 : 0;
  o.covariates.push_back(fan);
  test::set_y(o, o.y.colwise() + Eigen::VectorXd(0.02 * fan.value.col(0)));
  const Attribution found =
      attribute(o, seal_blocks(o, SearchSettings{}.seed).open, test::every_effect(), test::quick());
  ASSERT_EQ(found.accepted.size(), 1u);
  ASSERT_EQ(found.curves.size(), 1u);
  EXPECT_EQ(found.curves[0].curve.covariate, "fan_on");
  const auto open = seal_blocks(o, SearchSettings{}.seed).open;
  EXPECT_EQ(first_row_of(found.accepted[0].term), *std::ranges::lower_bound(open, static_cast<int>(first)));
}

/// The search never sees the session in which the propeller was nicked; the final fit does, and finds nothing
/// left beside it, however large the step is.
TEST_F(Steps, AStepInASealedSessionIsPlacedThere) {
  for (const auto& [size, into_session] : {std::pair(0.008, 0), std::pair(0.06, 4)}) {
    Observations o = ordered();
    const Seal seal = seal_blocks(o, SearchSettings{}.seed);
    int first = -1;
    for (const int row : seal.sealed) {
      const int block = o.block[static_cast<std::size_t>(row)];
      const bool start = o.block[static_cast<std::size_t>(row - (row > 0 ? 1 : 0))] != block;
      if (start && block >= 5 && block <= 10) first = row;
    }
    ASSERT_GE(first, 0);
    first += into_session;
    step(o, first, 1, -size);
    const Explanation e = explained(o);
    ASSERT_EQ(e.adopted.size(), 1u) << names(e);
    EXPECT_EQ(e.adopted[0].term.rotor, 1);
    EXPECT_TRUE(e.adopted[0].term.effect->has_change_point());
    const ParameterEstimate& run = e.adopted[0].parameters[1];
    EXPECT_NEAR(run.value, first, 1);
    EXPECT_EQ(run.run, o.name[static_cast<std::size_t>(run.value)]);
    EXPECT_THAT(explanation_text(e), HasSubstr(run.run));
    EXPECT_LE(run.low, first);
    EXPECT_GE(run.high, first);
    EXPECT_THAT(e.unknown, testing::IsEmpty()) << size;
  }
}

/// Two propellers exchanged at once, one for a better and one for a worse: what one makes hides in the
/// variance of the sessions as long as the other is there.
TEST_F(Steps, TwoThatAreOppositeAreBothFound) {
  for (const double size : {0.01, 0.03}) {
    Observations o = ordered();
    step(o, 64, 2, size);
    step(o, 64, 1, -size);
    const Explanation e = explained(o);
    ASSERT_EQ(e.adopted.size(), 2u) << names(e) << size;
    for (const AdoptedEffect& adopted : e.adopted) {
      EXPECT_TRUE(adopted.term.effect->has_change_point());
      EXPECT_TRUE(adopted.term.rotor == 1 || adopted.term.rotor == 2) << names(e);
    }
    EXPECT_LT(e.after.held_out_rmse, 1.4 * e.noise_floor);
  }
}

/// At a run in the midst of a session, not at the session's first.
TEST_F(Steps, OneInTheMidstOfASessionIsPlacedThere) {
  Observations o = ordered();
  const Index first = 68;
  step(o, first, 2, 0.012);
  const Explanation e = explained(o);
  ASSERT_EQ(e.adopted.size(), 1u) << names(e);
  const ParameterEstimate& run = e.adopted[0].parameters[1];
  EXPECT_NEAR(run.value, static_cast<double>(first), 1);
  EXPECT_LE(run.low, static_cast<double>(first));
  EXPECT_GE(run.high, static_cast<double>(first));
  EXPECT_TRUE(e.unknown.empty());
}

TEST_F(Steps, OneInTheMidstOfATablesBlockIsPlacedThere) {
  std::string csv = "b,run_order,y\n";
  for (int r = 0; r < 120; ++r)
    csv += fmt::format("{},{},{}\n", r / 10, r, (r < 63 ? 8 : 8.25) * (1 + 0.002 * scatter(random)));
  const Explanation e =
      explained(observed(csv,
                         "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                         "meaning = \"thrust_N\"\n[[covariates]]\ncolumn = \"run_order\"\nunit = \"1\"\n"));
  ASSERT_EQ(e.adopted.size(), 1u) << explanation_text(e);
  EXPECT_EQ(e.adopted[0].parameters[1].value, 63);
  EXPECT_EQ(e.adopted[0].confounded_with.size(), 1u) << "a step in zero or in gain: all runs have one force";
  EXPECT_FALSE(e.adopted[0].separating_run) << "nobody can set the number of a run";
  EXPECT_TRUE(e.suspect_rows.empty());
}

/// Whatever number the first run has, and in whatever order the file is written.
TEST_F(Steps, ATablesRunsHaveAnyNumbers) {
  for (const bool backwards : {false, true}) {
    std::string csv = "b,run_order,y\n";
    for (int i = 0; i < 120; ++i) {
      const int r = backwards ? 119 - i : i;
      csv += fmt::format("{},{},{}\n", r / 10, 1001 + 2 * r,
                         (r < 60 ? 8 : 8.25) * (1 + 0.002 * scatter(random)));
    }
    const Explanation e =
        explained(observed(csv,
                           "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                           "meaning = \"thrust_N\"\n[[covariates]]\ncolumn = \"run_order\"\nunit = \"1\"\n"));
    ASSERT_EQ(e.adopted.size(), 1u) << explanation_text(e);
    const ParameterEstimate& run = e.adopted[0].parameters[1];
    EXPECT_EQ(run.value, 1121);
    EXPECT_EQ(run.run, backwards ? "t.csv:61" : "t.csv:62");
  }
}

/// No model of the open runs can know on which side of the step a sealed session between them lies.
TEST_F(Steps, SealedRunsWhereItMayLieAreNotScored) {
  Observations o = ordered();
  const Seal seal = seal_blocks(o, SearchSettings{}.seed);
  Index first = -1;
  for (const int row : seal.sealed)
    if (row % 8 == 0 && row / 8 >= 5 && row / 8 <= 10) first = row;
  ASSERT_GE(first, 0);
  for (Index rotor = 0; rotor < 4; ++rotor) step(o, first, rotor, 0.02);
  const Explanation e = explained(o);
  ASSERT_EQ(e.adopted.size(), 1u) << names(e);
  EXPECT_THAT(e.warnings, Contains(HasSubstr("not scored: " + o.name[static_cast<std::size_t>(first)])));
  EXPECT_LT(e.after.held_out_rmse, 1.4 * e.noise_floor);
}

/// A step is tried at one row of three, and placed at any.
TEST_F(Steps, InALongTableAreFoundWhereTheyAre) {
  Observations o = test::simulate(
      {.runs_of_block = std::vector<int>(640, 1), .groups = 1, .sigma = 0.002, .session_ratio = 0}, random);
  o.blocks_are_rows = o.from_table = true;
  o.covariates.push_back({"run_order", Eigen::VectorXd::LinSpaced(o.rows(), 0, 639), true});
  const auto all = o.all_rows();
  const std::vector<Term> ways = ways_to_try(test::effect_named("propeller_step"), o, all);
  EXPECT_LE(ways.size(), 300u);
  EXPECT_GE(first_row_of(ways.front()), 32) << "the first rows of a long course are no step";
  EXPECT_LE(first_row_of(ways.back()), 608);
  for (const Index first : {300, 301, 302}) {
    Observations stepped = o;
    step(stepped, first, 0, 0.02);
    const auto effects = test::every_effect();
    const Attribution found = attribute(stepped, all, effects, test::quick());
    ASSERT_FALSE(found.accepted.empty());
    EXPECT_EQ(first_row_of(found.final.model.terms[0]), first);
  }
}

/// More groups than a candidate has columns, each with a step of its own.
TEST_F(Steps, OfAHundredGroupsAreFound) {
  constexpr int kGroups = 100, kFirst = 7 * kGroups;
  std::vector<double> size;
  for (int g = 0; g < kGroups; ++g) size.push_back(0.03 + 0.02 * scatter(random));
  std::string csv = "g,b,n,u\n";
  for (int n = 0; n < 14 * kGroups; ++n) {
    const int g = n % kGroups;
    const double force_N = (2 + 0.1 * g) * (1 + (n >= kFirst ? size[static_cast<std::size_t>(g)] : 0.0));
    csv += fmt::format("g{},{},{},{}\n", g, n / kGroups, n, force_N * (1 + 0.004 * scatter(random)));
  }
  const Explanation e = explained(observed(csv,
                                           "groups = [\"g\"]\nblocks = \"b\"\n[response]\ncolumn = \"u\"\n"
                                           "unit = \"N\"\n[[covariates]]\ncolumn = \"n\"\nunit = \"1\"\n"
                                           "meaning = \"run_order\"\n"));
  ASSERT_EQ(e.adopted.size(), 1u) << names(e);
  ASSERT_TRUE(e.adopted[0].term.per_group);
  EXPECT_NEAR(first_row_of(e.adopted[0].term), kFirst, 3);
  EXPECT_NEAR(e.adopted[0].parameters[0].value, 0.03, 0.01);
}

/// The last row of one group, and all of the next: a step there is that row's.
TEST_F(Steps, NoGroupTellsAStepByItsLastRow) {
  constexpr int kRows = 30;
  Observations o = test::simulate({.runs_of_block = std::vector<int>(2 * kRows, 1), .sigma = 0.01}, random);
  o.group_name = {"A", "B"};
  for (std::size_t row = 0; row < o.group.size(); ++row) o.group[row] = row < kRows ? 0 : 1;
  const auto possible = rows_where_a_step_may_begin(o, o.all_rows());
  EXPECT_THAT(possible, testing::AllOf(Contains(3), Contains(kRows - 3), Contains(kRows + 3)));
  for (const int row : {2, kRows - 2, kRows, kRows + 2, 2 * kRows - 2})
    EXPECT_THAT(possible, testing::Not(Contains(row)));
}

}  // namespace
}  // namespace tunnelrig
