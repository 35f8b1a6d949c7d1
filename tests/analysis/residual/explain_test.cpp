// The protocol from end to end on simulated observations, and what is written of it.
#include "analysis/residual/explain_contract.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using nlohmann::json;
using test::expect_contract;
using test::explained;
using test::ExplainTest;
using test::quick;
using testing::Contains;
using testing::HasSubstr;

TEST_F(ExplainTest, NothingIsFoundWhereThereIsNothing) {
  const Observations o = observations(16);
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "no_structure");
  EXPECT_TRUE(e.adopted.empty());
  EXPECT_TRUE(e.unknown.empty());
  EXPECT_EQ(e.after.rmse, e.before.rmse);
  EXPECT_EQ(e.after.held_out_rmse, e.before.held_out_rmse);
  EXPECT_EQ(e.after.held_out_low, e.before.held_out_low);
  EXPECT_EQ(e.after.held_out_high, e.before.held_out_high);
  EXPECT_GT(e.detectable, 0);
  EXPECT_LT(e.detectable, 3 * 0.002 * 7);
  EXPECT_EQ(e.blocks, 16);
  EXPECT_EQ(e.runs, 128);
  expect_contract(e);
  EXPECT_THAT(explanation_text(e), HasSubstr("no effect above"));
}

TEST_F(ExplainTest, OneStrongEffectIsNamedAndExplained) {
  Observations o = observations(16);
  test::add_effect(o, "supply_voltage", {0.5});
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "explained");
  ASSERT_EQ(e.adopted.size(), 1u);
  EXPECT_EQ(e.adopted[0].term.effect->name, "supply_voltage");
  EXPECT_LE(e.adopted[0].p_value, 0.02);
  EXPECT_GT(e.adopted[0].held_out_gain, 0);
  const ParameterEstimate& exponent = e.adopted[0].parameters.at(0);
  EXPECT_LT(exponent.low, 0.5);
  EXPECT_GT(exponent.high, 0.5);
  EXPECT_LT(e.after.held_out_rmse, 0.5 * e.before.held_out_rmse);
  EXPECT_NEAR(e.after.held_out_rmse / e.noise_floor, 1, 0.25);
  expect_contract(e);
}

/// A day that went wrong, and is seen by the seal alone.
TEST_F(ExplainTest, WhatTheSealedBlocksHaveBeyondTheFloorIsSaid) {
  const auto said = Contains(HasSubstr("times the noise floor"));
  Observations o = observations(16);
  EXPECT_THAT(explained(o).warnings, testing::Not(said));
  const int day = o.block[static_cast<std::size_t>(seal_blocks(o, quick().seed).sealed.front())];
  Eigen::MatrixXd y = o.y;
  for (Eigen::Index run = 0; run < o.rows(); ++run)
    if (o.block[static_cast<std::size_t>(run)] == day) y.row(run).array() += 0.04;
  test::set_y(o, y);
  const Explanation e = explained(o);
  EXPECT_TRUE(e.adopted.empty());
  EXPECT_THAT(e.warnings, said);
}

TEST_F(ExplainTest, TheSameSeedSaysTheSame) {
  Observations o = observations(10);
  test::add_effect(o, "supply_voltage", {0.1});
  EXPECT_EQ(explanation_json(explained(o)), explanation_json(explained(o)));
}

TEST_F(ExplainTest, FiveBlocksOrFewerAreInsufficientAlways) {
  for (const int blocks : {1, 2, 3, 4, 5}) {
    Observations o = observations(blocks);
    test::add_effect(o, "supply_voltage", {2});
    const Explanation e = explained(o);
    EXPECT_EQ(e.verdict, "insufficient") << blocks;
    EXPECT_TRUE(e.adopted.empty());
    EXPECT_EQ(e.after.held_out_rmse, e.before.held_out_rmse);
    EXPECT_GT(e.before.rmse, 0);
    EXPECT_LT(e.before.held_out_low, 0.95 * e.before.held_out_rmse);
    EXPECT_GT(e.before.held_out_high, 1.05 * e.before.held_out_rmse);
    expect_contract(e);
  }
  EXPECT_NE(explained(observations(6)).verdict, "insufficient");
}

TEST_F(ExplainTest, AnEffectOfOneRotorIsThatRotors) {
  Observations o = observations(16);
  test::add_covariate(o, "cable_force_N", -1, 1, random);
  const Covariate cable = *o.find("cable_force_N");
  Eigen::MatrixXd y = o.y;
  y.col(1) += 0.01 * cable.value;
  test::set_y(o, y);
  const Explanation e = explained(o);
  ASSERT_EQ(e.adopted.size(), 1u);
  EXPECT_EQ(e.adopted[0].term.effect->name, "cable_force");
  EXPECT_EQ(e.adopted[0].term.rotor, 1);
  EXPECT_EQ(json::parse(explanation_json(e))["adopted"][0]["rotor"], 2) << "rotors count from 1";
}

TEST_F(ExplainTest, EffectsThatGoTogetherAreConfounded) {
  Observations o = observations(16);
  Covariate excitation = *o.find("supply_voltage_V");  // one supply feeds both
  excitation.name = "excitation_voltage_V";
  excitation.value *= 5.0 / 16;
  o.covariates.push_back(excitation);
  test::add_effect(o, "supply_voltage", {0.5});
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "confounded");
  ASSERT_EQ(e.adopted.size(), 1u);
  std::vector<std::string> set = e.adopted[0].confounded_with;
  set.push_back(e.adopted[0].term.effect->name);
  EXPECT_THAT(set, testing::UnorderedElementsAre("supply_voltage", "excitation_voltage"));
  ASSERT_TRUE(e.adopted[0].separating_run.has_value());
  EXPECT_GT(e.adopted[0].separating_run->expected_sigma, 1);
  EXPECT_THAT(e.warnings, Contains(HasSubstr("go together")));
  for (const char* name : {"supply_voltage", "excitation_voltage"})
    EXPECT_TRUE(std::any_of(e.untestable.begin(), e.untestable.end(), [&](const Untestable& u) {
      return u.effect == name && u.reason.find("collinear") != std::string::npos;
    })) << name;
  expect_contract(e);
}

/// Of the battery's charge no effect is known, but it sinks with the voltage.
TEST_F(ExplainTest, AConditionWithoutANameThatGoesWithANamedOneIsSaid) {
  Observations o = observations(16);
  test::add_effect(o, "supply_voltage", {0.12});  // six standard errors or so
  const Eigen::VectorXd volts = o.find("supply_voltage_V")->value.col(0);
  const auto with_charge = [&](double scatter_V) {
    Observations both = o;
    std::normal_distribution<double> normal(0, scatter_V);
    Covariate charge{"battery_charge", volts};
    for (double& value : charge.value.reshaped()) value += normal(random);
    both.covariates.push_back(charge);
    return explained(both);
  };
  const auto said = Contains(HasSubstr("battery_charge go together"));
  const Explanation near = with_charge(0.02), far = with_charge(0.6);
  ASSERT_EQ(near.adopted.size(), 1u);
  EXPECT_EQ(near.adopted[0].term.effect->name, "supply_voltage");
  EXPECT_THAT(near.warnings, said);
  EXPECT_THAT(far.warnings, testing::Not(said));
}

/// One that would need an exponent of 25 for the same is no rival.
TEST_F(ExplainTest, RivalsStayWithinTheirBounds) {
  Observations o = observations(16);
  Covariate excitation = *o.find("supply_voltage_V");
  excitation.name = "excitation_voltage_V";
  excitation.value = 5 + 5.0 / 16 * (excitation.value.array() - 16) / 50;
  o.covariates.push_back(excitation);
  test::add_effect(o, "supply_voltage", {0.5});
  const Explanation e = explained(o);
  ASSERT_EQ(e.adopted.size(), 1u);
  EXPECT_EQ(e.adopted[0].term.effect->name, "supply_voltage");
  EXPECT_THAT(e.adopted[0].confounded_with, testing::Not(Contains("excitation_voltage")));
}

TEST_F(ExplainTest, WhatVariesBetweenSessionsIsSeenFromMore) {
  Observations o = test::simulate(
      {.runs_of_block = std::vector<int>(16, 8), .channels = 4, .sigma = 0.002, .session_ratio = 2}, random);
  test::add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
  test::add_covariate(o, "air_pressure_Pa", 100500, 102500, random);
  Covariate& pressure = o.covariates.back();
  for (Eigen::Index row = 0; row < o.rows(); ++row) pressure.value(row, 0) = pressure.value(row - row % 8, 0);
  const Explanation e = explained(o);
  const double between = e.detectable_by_effect.at("air_pressure");
  EXPECT_GT(between, 2 * e.detectable_by_effect.at("supply_voltage"));
  EXPECT_GE(e.detectable, between);
  EXPECT_THAT(explanation_text(e), HasSubstr("would have been seen from"));
}

TEST_F(ExplainTest, WhatCannotVaryIsUntestableWithAReason) {
  Observations o = observations(8);
  Covariate constant{"excitation_voltage_V", Eigen::MatrixXd::Constant(o.rows(), 1, 5.0)};
  o.covariates.push_back(constant);
  const Explanation e = explained(o);
  const auto entry = std::find_if(e.untestable.begin(), e.untestable.end(),
                                  [](const Untestable& u) { return u.effect == "excitation_voltage"; });
  ASSERT_NE(entry, e.untestable.end());
  EXPECT_THAT(entry->reason, HasSubstr("does not vary"));
  const auto missing = std::find_if(e.untestable.begin(), e.untestable.end(),
                                    [](const Untestable& u) { return u.effect == "ground_effect"; });
  ASSERT_NE(missing, e.untestable.end());
  EXPECT_THAT(missing->missing, testing::ElementsAre("ground_distance_R"));
}

TEST_F(ExplainTest, CandidatesAreListedWithAndWithoutData) {
  const json all = json::parse(candidates_json(test::every_effect(), nullptr));
  EXPECT_EQ(all.size(), all_effects().size());
  for (const json& one : all)
    for (const char* key : {"effect", "form", "formula", "physics", "parameters", "covariates", "sign"})
      EXPECT_TRUE(one.contains(key)) << key;
  Observations o = observations(8);
  test::add_covariate(o, "ground_distance_R", 3, 3, random);
  const CanBeFound can_be_found(o);
  for (const json& one : json::parse(candidates_json(test::every_effect(), &can_be_found))) {
    if (one["effect"] == "supply_voltage") {
      EXPECT_TRUE(one["testable"]);
    }
    if (one["effect"] == "ground_effect") {
      EXPECT_THAT(one["reason"].get<std::string>(), HasSubstr("does not vary within any location"));
    }
    if (one["effect"] == "cable_force") {
      EXPECT_FALSE(one["testable"]);
      EXPECT_EQ(one["missing"], json::array({"cable_force_N"}));
    }
  }
  EXPECT_THAT(candidates_text(test::every_effect(), &can_be_found), HasSubstr("not recorded: cable_force_N"));
}

TEST_F(ExplainTest, RoundsKeepWhatTheySaw) {
  Observations o = observations(10);
  test::add_effect(o, "supply_voltage", {0.5});
  const Explanation e = explained(o);
  EXPECT_FALSE(e.rounds.empty());
  EXPECT_FALSE(e.rounds[0].null_maxima.empty());
  EXPECT_FALSE(e.rounds[0].ranking.empty());
  EXPECT_EQ(e.rounds[0].ranking[0].term.effect->name, "supply_voltage");
}

TEST_F(ExplainTest, RotorSpeedIsARivalAtItsOwnExponentOnly) {
  Observations o = observations(16);
  test::add_covariate(o, "speed_rpm", 0, 1, random);
  // Speed follows the supply: with an exponent of a half, speed would do as well, and with two it does not.
  for (Covariate& covariate : o.covariates)
    if (covariate.name == "speed_rpm")
      covariate.value = o.rig.nominal_speed_rpm / 16 * o.find("supply_voltage_V")->value;
  test::add_effect(o, "supply_voltage", {0.5});
  const Explanation e = explained(o);
  ASSERT_EQ(e.adopted.size(), 1u);
  EXPECT_NE(e.adopted[0].term.effect->name, "rotor_speed");
  EXPECT_THAT(e.adopted[0].confounded_with, testing::Not(Contains("rotor_speed")));
}

TEST_F(ExplainTest, WhatWouldBeDetectedIsFiniteWhereNothingCanBeTested) {
  Observations o = observations(16);
  o.covariates.clear();
  const Explanation nothing = explain(o, {&test::effect_named("supply_voltage")}, quick());
  EXPECT_EQ(nothing.verdict, "no_structure");
  // 128 runs of four rotors, session variance 0.4 of the runs': 3.17 standard errors of one effect
  EXPECT_NEAR(nothing.detectable, 7 * 0.002 * 3.17 * std::sqrt(1.4 / 125 / 4), 0.4 * nothing.detectable);
  const Explanation few = explained(observations(5));
  EXPECT_EQ(few.verdict, "insufficient");
  EXPECT_GT(few.detectable, 0);
}

TEST(VerdictInWords, SaysWhatTheSealedBlocksDoNotBearOut) {
  Explanation e{.verdict = "explained", .model = {}};
  e.before.held_out_rmse = 2;
  e.after.held_out_rmse = 1;
  EXPECT_EQ(verdict_in_words(e), "The effects below explain what the model lacked.");
  e.sealed.beyond_floor = true;
  EXPECT_THAT(verdict_in_words(e), testing::HasSubstr("something else varies in the sealed blocks"));
  e.after.held_out_rmse = 2;
  EXPECT_THAT(verdict_in_words(e), testing::HasSubstr("do not predict the sealed blocks better"));
  e.verdict = "confounded";
  EXPECT_THAT(verdict_in_words(e), testing::HasSubstr("does not predict the sealed blocks better"));
}

}  // namespace
}  // namespace tunnelrig
