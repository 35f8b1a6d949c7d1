// Some of the runs: what they keep of the numbers they had, and what is not seen of the others.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/explanation/seal.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <algorithm>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

struct Subset : testing::Test {
  std::mt19937_64 random{test::seed()};

  static std::vector<int> all_but(const Observations& o, const std::vector<int>& left_out) {
    std::vector<int> rows = o.all_rows();
    std::erase_if(rows, [&](int row) { return std::ranges::count(left_out, row) > 0; });
    return rows;
  }

  /// With tares at the sessions' starts, by which a step is nowhere seen.
  Observations tared() {
    Observations o = test::simulate({.runs_of_block = std::vector<int>(12, 6), .channels = 4}, random);
    Covariate order{"run_order", MatrixXd(o.rows(), 1)};
    for (Index row = 0; row < o.rows(); ++row) order.value(row, 0) = static_cast<double>(row + 1);
    order.derived = true;
    order.at_zero = MatrixXd(o.rows(), 4);
    for (Index row = 0; row < o.rows(); ++row)
      order.at_zero.row(row).setConstant(static_cast<double>(row / 6 * 6));
    o.covariates.push_back(order);
    return o;
  }

  static MatrixXd step_from(const Observations& o, double first) {
    const Term step{.effect = &test::effect_named("mounting_step"), .parameters = {0.01, first}};
    return respond(step, o, o.value).value[0];
  }
};

TEST_F(Subset, RunNumbersOfZerosMoveWithTheRuns) {
  const Observations whole = tared();
  ASSERT_TRUE(step_from(whole, 36).isZero(1e-12)) << "the tares take it off";
  const Observations part = whole.subset(all_but(whole, {3, 12, 13, 40}));
  for (const int block : {4, 6, 8}) {
    const auto first = std::ranges::find(part.block, block) - part.block.begin();
    EXPECT_TRUE(step_from(part, static_cast<double>(first)).isZero(1e-12)) << block;
  }
}

TEST_F(Subset, AZeroTakenAtARunThatIsGoneBelongsToTheNextOfItsBlockOrTheLast) {
  Observations whole = tared();
  MatrixXd& at_zero = whole.covariates.back().at_zero;
  at_zero.row(7).setConstant(11);  // the last of block 1
  at_zero(8, 0) = std::numeric_limits<double>::quiet_NaN();
  const Observations part = whole.subset(all_but(whole, {6, 11}));
  const MatrixXd& moved = part.covariates.back().at_zero;
  EXPECT_EQ(moved(6, 0), 9) << "row 7, at the last run of block 1, which is row 10 now the last";
  EXPECT_TRUE(std::isnan(moved(7, 0)));
  EXPECT_EQ(moved(8, 0), 6) << "at the first run of block 1, whose next is the first now";
}

/// The run before tells what hysteresis does: by forces that are predicted from open runs alone.
TEST_F(Subset, NothingIsSearchedByResponsesOfSealedRuns) {
  Observations o = test::simulate({.runs_of_block = std::vector<int>(12, 6), .groups = 4}, random);
  test::set_y(o, o.y + 0.1 * Eigen::VectorXi::Map(o.group.data(), o.rows()).cast<double>());
  const Seal seal = seal_blocks(o, 1);
  Observations other = o;
  MatrixXd y = o.y;
  for (const int row : seal.sealed) y(row, 0) += std::normal_distribution<double>(0, 0.3)(random);
  test::set_y(other, y);
  const std::vector<const Effect*> effects = {&test::effect_named("hysteresis")};
  const Attribution found = attribute(o, seal.open, effects, test::quick());
  const Attribution again = attribute(other, seal.open, effects, test::quick());
  ASSERT_FALSE(found.rounds.empty());
  EXPECT_EQ(found.rounds[0].observed, again.rounds[0].observed);
  EXPECT_EQ(found.final.variances.log_likelihood, again.final.variances.log_likelihood);
  EXPECT_EQ(again.observations.y, other.y) << "and what was hidden is there again";
}

/// What one rotor goes with is looked for by that rotor's values, whatever the first one's are.
TEST_F(Subset, BendsOverARotorsOwnConditionNeedThatRotorsValues) {
  Observations o = test::four_rotors(3, 0.002, random);
  Covariate own{"clip_fraction", MatrixXd::Zero(o.rows(), 4)};
  for (Index row = 0; row < o.rows(); ++row) own.value(row, 2) = static_cast<double>(row % 12) / 12;
  o.covariates.push_back(own);
  std::vector<int> rotors;
  for (const Curve& curve : curves_to_try(o, o.all_rows()))
    if (curve.covariate == "clip_fraction" && curve.shape == CurveShape::kWaves && curve.columns.size() == 2)
      rotors.push_back(curve.rotor);
  EXPECT_THAT(rotors, testing::ElementsAre(-1, 2));
}

/// Runs that stand alone at their location, or in twos, say nothing of how runs scatter.
TEST_F(Subset, RunsThatStandAloneMakeNoOthersWild) {
  Observations o = test::four_rotors(60, 0.002, random);
  EXPECT_TRUE(wild_runs(o).empty());
  o = test::four_rotors(40, 0.002, random);
  EXPECT_TRUE(wild_runs(o).empty());
}

}  // namespace
}  // namespace tunnelrig
