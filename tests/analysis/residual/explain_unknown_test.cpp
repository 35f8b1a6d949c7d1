// What is unknown, and when: curves, values, sessions; names that give way to them.
#include "analysis/residual/explain_contract.h"

#include <cmath>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::expect_contract;
using test::explained;
using test::ExplainTest;
using test::quick;
using testing::Contains;
using testing::HasSubstr;

TEST_F(ExplainTest, StructureWithoutANameIsUnknown) {
  Observations o = observations(16);
  test::add_covariate(o, "cable_slack_mm", 0, 30, random);
  const Eigen::MatrixXd wave = (0.35 * o.find("cable_slack_mm")->value.array()).sin();
  test::set_y(o, o.y + 0.006 * wave.replicate(1, 4));
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "unknown");
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].covariate, "cable_slack_mm");
  EXPECT_EQ(e.unknown[0].rotor, -1);
  EXPECT_NEAR(e.unknown[0].amplitude, 0.006 * 7, 0.3 * 0.006 * 7) << "half of peak to peak, newtons";
  EXPECT_GE(e.unknown[0].shape.size(), 10u);
  EXPECT_EQ(e.after.held_out_rmse, e.before.held_out_rmse) << "a curve without a name is not adopted";
  expect_contract(e);
  EXPECT_THAT(explanation_text(e), HasSubstr("depends on cable_slack_mm"));
  EXPECT_TRUE(e.empirical.empty());

  SearchSettings empirical = quick();
  empirical.empirical = true;
  const Explanation curved = explain(o, test::every_effect(), empirical);
  EXPECT_EQ(curved.verdict, "unknown") << "a curve is no cause";
  EXPECT_THAT(curved.empirical, testing::ElementsAre("cable_slack_mm"));
  EXPECT_GT(curved.before.held_out_rmse, 1.5 * curved.after.held_out_rmse);
  EXPECT_NEAR(curved.after.held_out_rmse / curved.noise_floor, 1, 0.25);
  EXPECT_THAT(explanation_text(curved), HasSubstr("with the empirical curve over cable_slack_mm"));
  expect_contract(curved);

  test::add_effect(o, "supply_voltage", {0.6});
  const Explanation both = explained(o);
  EXPECT_EQ(both.verdict, "partly_explained") << "unknown structure goes before everything that is named";
  ASSERT_EQ(both.adopted.size(), 1u);
  EXPECT_EQ(both.adopted[0].term.effect->name, "supply_voltage");
  expect_contract(both);
}

TEST_F(ExplainTest, SessionsThatDifferByFarMoreThanTheirRunsAreUnknown) {
  const auto with = [&](double session_ratio) {
    return explained(test::simulate(
        {.runs_of_block = std::vector<int>(16, 8), .channels = 4, .session_ratio = session_ratio}, random));
  };
  EXPECT_EQ(with(0.4).verdict, "no_structure");
  const Explanation e = with(25);
  EXPECT_EQ(e.verdict, "unknown");
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].covariate, "session");
  EXPECT_LT(e.unknown[0].p_value, 0.025) << "of a ratio of 2 or less";
  EXPECT_GT(e.unknown[0].p_value, 0);
  ASSERT_EQ(e.unknown[0].shape.size(), 16u) << "one point of each session";
  for (const auto& [x, y, low, high] : e.unknown[0].shape) {
    EXPECT_LT(low, y);
    EXPECT_LT(high - low, 0.05) << "runs of 14 mN on the mean of four rotors and eight runs";
  }
  EXPECT_GT(e.unknown[0].amplitude, 0.02) << "sessions of 35 mN";
  expect_contract(e);
}

/// A switch, or a few settings: nothing lies between them, and no wave or bend sees them.
TEST_F(ExplainTest, FewValuesAreHeldAgainstEachOther) {
  for (const int values : {2, 3, 5}) {
    Observations o = observations(16);
    test::add_covariate(o, "foam_layers", 0, values, random);
    Covariate& foam = o.covariates.back();
    foam.value = foam.value.array().floor().matrix();
    const Eigen::MatrixXd linear = 0.006 / (values - 1) * foam.value;
    test::set_y(o, o.y + linear.replicate(1, 4));
    const Explanation e = explained(o);
    SCOPED_TRACE(explanation_text(e));
    EXPECT_EQ(e.verdict, "unknown");
    ASSERT_EQ(e.unknown.size(), 1u);
    EXPECT_EQ(e.unknown[0].covariate, "foam_layers");
    ASSERT_EQ(e.unknown[0].shape.size(), static_cast<std::size_t>(values));
    const ShapePoint &first = e.unknown[0].shape.front(), &last = e.unknown[0].shape.back();
    EXPECT_EQ(first.x, 0);
    EXPECT_EQ(last.x, values - 1);
    EXPECT_NEAR(last.y - first.y, 0.006 * 7, 0.3 * 0.006 * 7) << "newtons";
    EXPECT_LT(first.low, first.y);
    EXPECT_TRUE(e.unknown[0].labels.empty());
    expect_contract(e);
  }
}

TEST_F(ExplainTest, AValueThatTwoBlocksHaveIsNotToldFromTheirScatter) {
  Observations o = observations(16);
  Covariate fan{"fan_on", Eigen::MatrixXd::Zero(o.rows(), 1)};
  for (const int row : o.all_rows())
    if (o.block[static_cast<std::size_t>(row)] < 2) fan.value(row, 0) = 1;
  o.covariates.push_back(fan);
  for (const Curve& curve : curves_to_try(o, o.all_rows())) EXPECT_NE(curve.covariate, "fan_on");
  EXPECT_THAT(explained(o).warnings,
              Contains(HasSubstr("fan_on has fewer than two values that three open blocks have")));
}

TEST_F(ExplainTest, AConditionThatOnlyLocationsDifferByIsSaid) {
  Observations o = observations(16);
  Covariate height{"stand_height_m", Eigen::MatrixXd(o.rows(), 1)};
  for (const int row : o.all_rows()) height.value(row, 0) = 0.5 + o.group[static_cast<std::size_t>(row)];
  o.covariates.push_back(height);
  EXPECT_THAT(explained(o).warnings,
              Contains(HasSubstr("stand_height_m does not vary within any location: nothing")));
}

/// A trend that bends: the best formula of the library takes the trend, and is not what the covariate does.
TEST_F(ExplainTest, AFormulaThatItsOwnCovariateBendsAwayFromIsNoName) {
  Observations o = observations(16);
  const Eigen::ArrayXd u = 2 * (o.find("supply_voltage_V")->value.array() - 16);  // −1 … 1
  const Eigen::MatrixXd bent = 0.004 * (u + 1.5 * u.square()).matrix();
  test::set_y(o, o.y + bent.replicate(1, 4));
  const Explanation e = explained(o);
  SCOPED_TRACE(explanation_text(e));
  EXPECT_EQ(e.verdict, "unknown");
  EXPECT_TRUE(e.adopted.empty());
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].covariate, "supply_voltage_V");
  EXPECT_THAT(e.unknown[0].instead_of, testing::ElementsAre("supply_voltage"));
  EXPECT_THAT(explanation_text(e), HasSubstr("bends away from the formula of supply_voltage"));
  // trend and bend, within the band at its two ends and in the middle
  const auto at = [&](double volts) {
    return *std::min_element(
        e.unknown[0].shape.begin(), e.unknown[0].shape.end(),
        [&](const auto& a, const auto& b) { return std::abs(a.x - volts) < std::abs(b.x - volts); });
  };
  EXPECT_GT(at(16.4).y, at(16).y + 0.02);
  EXPECT_GT(at(16.4).y, at(15.6).y + 0.02);
  expect_contract(e);

  Observations straight = observations(16);
  test::add_effect(straight, "supply_voltage", {0.3});
  const Explanation named = explained(straight);
  ASSERT_EQ(named.adopted.size(), 1u);
  EXPECT_EQ(named.adopted[0].term.effect->name, "supply_voltage");
  EXPECT_TRUE(named.unknown.empty());
}

/// The same where another column tells as much: beside a curve over that one, the name would have any size.
TEST_F(ExplainTest, ANameAndACurveOverTheLikeThatCancelAreNoName) {
  for (int number = 0; number < 6; ++number) {
    Observations o = observations(16);
    const Eigen::ArrayXd u = 2 * (o.find("supply_voltage_V")->value.array() - 16);
    std::normal_distribution<double> normal(0, 0.02);
    o.covariates.push_back(
        {"throttle", (u + Eigen::ArrayXd::NullaryExpr(u.size(), [&] { return normal(random); })).matrix()});
    test::set_y(
        o, o.y + (0.004 * (u + 1.5 * o.find("throttle")->value.array().square())).matrix().replicate(1, 4));
    const Explanation e = explained(o);
    EXPECT_TRUE(e.adopted.empty()) << explanation_text(e);
    EXPECT_EQ(e.unknown.size(), 1u);
  }
}

/// That it is the same in all sessions is what makes it a course, and no reason to take it for their scatter.
TEST_F(ExplainTest, ACourseThatEveryRunHasIsNoScatterOfSessions) {
  for (const double times : {0.0, 20.0}) {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(7, 11), .channels = 4, .shapes = 6, .session_ratio = 0}, random);
    o.shape[0].array() += times * 0.002;
    o.shape[2].array() += times * 0.002 / 9;
    const Explanation e = explained(o);
    ASSERT_EQ(e.unknown.size(), times > 0 ? 1u : 0u) << explanation_text(e);
    if (times > 0) {
      EXPECT_EQ(e.unknown[0].covariate, "time_in_run");
      EXPECT_FALSE(e.unknown[0].by_sealed_too) << "five open sessions show it";
    }
  }
}

/// "No effect above …" of one name is no statement about the others.
TEST_F(ExplainTest, WhereOneNameAloneIsTestedItIsSaid) {
  const Observations o = observations(16);
  const std::vector<const Effect*> one = {&test::effect_named("supply_voltage")};
  const Explanation of_one = explain(o, one, quick());
  ASSERT_EQ(of_one.verdict, "no_structure") << explanation_text(of_one);
  EXPECT_THAT(explanation_text(of_one), HasSubstr("these data test no name but supply_voltage"));
  EXPECT_THAT(explanation_text(explained(o)), testing::Not(HasSubstr("no name but")));
}

}  // namespace
}  // namespace tunnelrig
