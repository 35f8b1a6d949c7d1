// Scatter that goes with a condition: what it is taken for, and what it no longer hides.
#include "analysis/residual/scatter/condition_scatter.h"

#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::explained;
using testing::Contains;
using testing::HasSubstr;

constexpr double kCalmSigma = 0.002;

struct ConditionScatter : testing::Test {
  std::mt19937_64 random{test::seed()};

  Observations observations() { return test::four_rotors(8, kCalmSigma, random); }

  /// Of each run, over the calmest: 1 without wind, `times` at the most of it.
  static VectorXd gusts(const Observations& o, double times) {
    return (o.find("tunnel_airspeed_m_s")->value.col(0).array() / 0.4 * std::log(times)).exp();
  }

  void let_scatter(Observations& o, const VectorXd& times) {
    std::normal_distribution<double> normal;
    MatrixXd y = o.y;
    for (Index row = 0; row < y.rows(); ++row)
      for (Index c = 0; c < y.cols(); ++c)
        y(row, c) += kCalmSigma * std::sqrt(times(row) * times(row) - 1) * normal(random);
    test::set_y(o, y);
  }

  /// Without anything adopted.
  RunScatter::ByCondition found(const Observations& o) {
    return condition_scatter(o, o.all_rows(), {o.y}, {}, o.value, random).by_condition;
  }
};

TEST_F(ConditionScatter, IsFoundWhereItIsAndNowhereElse) {
  constexpr int kCampaigns = 30;
  int alike_differ = 0, differ = 0;
  double slope = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations();
    alike_differ += found(o).names.empty() ? 0 : 1;
    const VectorXd truth = gusts(o, 6).array().log();
    let_scatter(o, gusts(o, 6));
    const RunScatter::ByCondition scatter = found(o);
    if (!scatter.names.contains("tunnel_airspeed_m_s")) continue;
    ++differ;
    EXPECT_NEAR(scatter.runs.squaredNorm() / static_cast<double>(o.rows()), 1, 1e-9);
    const VectorXd log = scatter.runs.array().log(), from_mean = truth.array() - truth.mean();
    slope += from_mean.dot(log) / from_mean.squaredNorm() / kCampaigns;
  }
  EXPECT_LE(alike_differ, 1) << "0.25 % of 30 are expected";
  EXPECT_EQ(differ, kCampaigns);
  EXPECT_NEAR(slope, 1, 0.15);
}

/// Tails are heavier than normal, and go with nothing.
TEST_F(ConditionScatter, HeavyTailsAreNone) {
  constexpr int kCampaigns = 30;
  int differ = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations();
    std::student_t_distribution<double> heavy(3);
    const MatrixXd y =
        o.y + MatrixXd::NullaryExpr(o.rows(), 4, [&] { return 2 * kCalmSigma * heavy(random); });
    test::set_y(o, y);
    differ += found(o).names.empty() ? 0 : 1;
  }
  EXPECT_LE(differ, 1);
}

TEST_F(ConditionScatter, IsSaidAndIsNoStructureAndTheFloorKnowsIt) {
  constexpr int kCampaigns = 12;
  int structure = 0, said = 0;
  double over_floor = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations();
    let_scatter(o, gusts(o, 8));
    const Explanation e = explained(o);
    structure += e.verdict == "no_structure" ? 0 : 1;
    said += testing::Value(e.warnings, Contains(HasSubstr("scatter more or less with tunnel_airspeed_m_s")))
                ? 1
                : 0;
    over_floor += std::log(e.after.held_out_rmse / e.noise_floor) / kCampaigns;
  }
  EXPECT_EQ(said, kCampaigns);
  EXPECT_LE(structure, 2);
  EXPECT_NEAR(std::exp(over_floor), 1, 0.1);
}

/// A cell's constant error in newtons is a scatter of C_T that falls with the force.
TEST_F(ConditionScatter, OfTheForceIsFoundAsWell) {
  Observations o = observations();
  test::add_covariate(o, "relative_humidity", 0.3, 0.6, random);
  std::uniform_real_distribution<double> speed(0.5, 1);
  VectorXd times(o.rows());
  for (Index row = 0; row < o.rows(); ++row) {
    const double square = std::pow(speed(random), 2);
    times(row) = 1 / square;
    o.known.row(row) *= square;
  }
  let_scatter(o, times);
  const RunScatter::ByCondition scatter = found(o);
  EXPECT_THAT(scatter.names, testing::ElementsAre("the predicted " + o.response));
  const VectorXd left = scatter.runs.cwiseQuotient(times);
  EXPECT_LT(left.maxCoeff() / left.minCoeff(), 1.6);
}

/// A tenth of the rms scatter of one run and rotor: the calm ones show it.
TEST_F(ConditionScatter, DoesNotHideAnEffectThatCalmRunsShow) {
  constexpr int kCampaigns = 8;
  int named = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations();
    test::add_effect(o, "supply_voltage", {0.09});  // 0.16 %, rms
    let_scatter(o, gusts(o, 20));
    const Explanation e = explained(o);
    named += e.adopted.size() == 1 && e.adopted[0].term.effect->name == "supply_voltage" ? 1 : 0;
  }
  EXPECT_GE(named, 6);
}

}  // namespace
}  // namespace tunnelrig
