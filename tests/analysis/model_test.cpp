// Versions of the model: written and read, and led through readings and back.
#include "analysis/location_summary.h"
#include "analysis/model/adopt.h"
#include "analysis/model/apply_model.h"
#include "analysis/model/model_store.h"
#include "support/message_of.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

const Effect& effect_named(const std::string& name) {
  for (const Effect& effect : all_effects())
    if (effect.name == name) return effect;
  throw std::invalid_argument(name);
}

ModelTerm term(const std::string& name, std::vector<double> parameters, std::vector<double> reference,
               int rotor = -1, int other = -1) {
  const Effect& effect = effect_named(name);
  ModelTerm result{.effect = &effect,
                   .rotor = rotor,
                   .other = other,
                   .parameters = std::move(parameters),
                   .reference = std::move(reference)};
  for (const EffectParameter& parameter : effect.parameters) result.units.push_back(parameter.unit);
  return result;
}

ModelVersion model_of(std::vector<ModelTerm> terms) {
  ModelVersion model{.version = 1, .terms = std::move(terms), .dof = 17, .explanation = "{}"};
  const auto size = model.parameters().size();
  model.covariance = 1e-6 * Eigen::MatrixXd::Identity(size, size);
  return model;
}

CampaignData campaign(const std::string& rows) {
  CampaignData data;
  data.info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
  data.runs = parse_runs(
      parse_csv("run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N,"
                "air_temperature_C,air_pressure_Pa,time_since_motor_start_s,clip\n" +
                    rows,
                "runs.csv"),
      data.info);
  return data;
}

CampaignData four_runs() {
  return campaign(
      "R1,OT,1,S1,2026-03-02T08:00Z,,7.1,7.4,7.6,7.2,20,100000,30,0.1\n"
      "R2,OS,1,S1,2026-03-02T08:10Z,,7.9,7.8,7.7,7.6,21,100100,300,0.2\n"
      "R3,OT,2,S2,2026-03-03T08:00Z,,7.2,7.3,7.5,7.3,22,99000,90,0.4\n"
      "R4,OS,2,S2,2026-03-03T08:10Z,,7.8,7.7,7.9,7.5,23,98000,900,0.8\n");
}

Reduction corrected(const CampaignData& data, const ModelVersion& model) {
  return apply_model(data, reduce_runs(data, {}), model);
}

TEST(ApplyModel, MeasuredPressureAtTheorysExponentIsTheTermAirPressure) {
  const CampaignData data = four_runs();
  const Reduction by_model = corrected(data, model_of({term("air_pressure", {1}, {100000})}));
  const Reduction by_term = reduce_runs(data, terms_from_names("air_pressure"));
  ASSERT_EQ(by_model.runs.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(by_model.runs[i].c_t / by_term.runs[i].c_t, 1, 1e-12);
}

TEST(ApplyModel, ReadingsAreLedBackThroughEveryTerm) {
  // e(F) = F (1 + c (1 − e^(−t/τ))) · (1 + x F_2 / F_1) for rotor 1, without x for the others
  const CampaignData data = four_runs();
  const double c = 0.05, tau = 100, x = -0.03;
  const Reduction reduction =
      corrected(data, model_of({term("creep", {c, tau}, {100}), term("crosstalk", {x}, {}, 0, 1)}));
  ASSERT_EQ(reduction.runs.size(), 4u);
  for (const RunCoefficients& run : reduction.runs) {
    const tunnelrig::Run& given = data.runs[run.run];
    const double creep = 1 + c * (1 - std::exp(-*given.number("time_since_motor_start_s") / tau));
    const auto& force = run.thrust_N;
    EXPECT_NEAR(force[0] * creep * (1 + x * force[1] / force[0]), *given.thrust_N[0], 1e-10 * 8);
    for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(force[i] * creep, *given.thrust_N[i], 1e-10 * 8);
    // what stands in runs without effect changes: coefficients follow the thrusts
    EXPECT_NEAR(run.total_N, force[0] + force[1] + force[2] + force[3], 1e-12);
  }
}

/// Air, then cell, then what is added, in whatever order they were adopted.
TEST(ApplyModel, WhereEffectsAddEachActsOnWhatThoseBeforeItMade) {
  const CampaignData data = four_runs();
  const double c = 0.05, tau = 100, x = -0.03;
  ModelVersion model = model_of({term("crosstalk", {x}, {}, 0, 1), term("creep", {c, tau}, {100}),
                                 term("air_pressure", {1}, {100000})});
  model.multiplicative = false;
  const Reduction reduction = corrected(data, model);
  ASSERT_EQ(reduction.runs.size(), 4u);
  for (const RunCoefficients& run : reduction.runs) {
    const tunnelrig::Run& given = data.runs[run.run];
    const double creep = 1 + c * (1 - std::exp(-*given.number("time_since_motor_start_s") / tau));
    const double air = *given.number("air_pressure_Pa") / 101325;
    const auto& force = run.thrust_N;
    EXPECT_NEAR(force[0] * air * creep + x * force[1] * air * creep, *given.thrust_N[0], 1e-9);
    EXPECT_NEAR(force[1] * air * creep, *given.thrust_N[1], 1e-9);
  }
}

/// A factor beside it makes a drift of the zero neither larger nor smaller: as the model is fitted.
TEST(ApplyModel, WhatIsAddedIsNotMultiplied) {
  const CampaignData data = four_runs();
  const double c = 0.3, tau = 100;
  const ModelTerm drift = term("zero_drift_time", {0.02}, {0}), creep = term("creep", {c, tau}, {100});
  const Reduction with_drift = corrected(data, model_of({drift}));
  const Reduction with_both = corrected(data, model_of({drift, creep}));
  ASSERT_EQ(with_both.runs.size(), 4u);
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const tunnelrig::Run& given = data.runs[with_both.runs[i].run];
    const double by_creep = 1 + c * (1 - std::exp(-*given.number("time_since_motor_start_s") / tau));
    const double added_N = *given.thrust_N[0] - with_drift.runs[i].thrust_N[0];
    most = std::max(most, std::abs(added_N));
    EXPECT_NEAR(with_both.runs[i].thrust_N[0] * by_creep + added_N, *given.thrust_N[0], 1e-9);
  }
  EXPECT_GT(most, 1e-4);
}

TEST(ApplyModel, ACurveIsTakenOutAndHeldBeyondItsRange) {
  ModelVersion model{.version = 1, .explanation = "{}"};
  model.curves = {{.covariate = "clip", .low = 0.1, .high = 0.4, .coefficients = {0.02}, .centre = {0.5}}};
  model.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-6);
  const CampaignData data = four_runs();
  const Reduction reduction = corrected(data, model);
  const auto ratio = [&](std::size_t run) {
    return reduction.runs[run].thrust_N[2] / *data.runs[run].thrust_N[2];
  };
  EXPECT_NEAR(ratio(0), std::exp(-0.02 * (1 - 0.5)), 1e-12);
  EXPECT_NEAR(ratio(2), std::exp(-0.02 * (-1 - 0.5)), 1e-12);
  EXPECT_NEAR(ratio(3), ratio(2), 1e-12) << "0.8 lies beyond the range: the end holds";
  EXPECT_EQ(reduction.model_name(), "version 1 (curve over clip (empirical))");
}

TEST(ApplyModel, LevelsHoldWhereTheyWereSeenOnly) {
  ModelVersion model{.version = 1, .explanation = "{}"};
  model.curves = {{.covariate = "blades",
                   .shape = CurveShape::kLevels,
                   .low = 1,
                   .high = 2,
                   .coefficients = {0.03},
                   .centre = {0.01},
                   .levels = {2, 1},
                   .labels = {"new", "old"}}};
  model.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-6);
  CampaignData data = four_runs();
  // other texts are in this campaign, so that their numbers are others
  for (std::size_t i = 0; i < 4; ++i) data.runs[i].labels["blades"] = i < 2 ? "old" : i < 3 ? "new" : "bent";
  const Reduction reduction = corrected(data, model_from_json(model_json(model), "it"));
  ASSERT_EQ(reduction.runs.size(), 3u);
  const auto ratio = [&](std::size_t run) {
    return reduction.runs[run].thrust_N[0] / *data.runs[run].thrust_N[0];
  };
  EXPECT_NEAR(ratio(0), std::exp(0.03 * 0.01), 1e-12) << "the most common: no more than the centre";
  EXPECT_NEAR(ratio(2), std::exp(-0.03 * (1 - 0.01)), 1e-12);
  ASSERT_EQ(reduction.left_out.size(), 1u);
  EXPECT_THAT(reduction.left_out[0].reason,
              HasSubstr("its blades is none that the adopted curve over blades"));
  model.curves[0].levels = {1};
  EXPECT_THAT(message_of([&] { model_from_json(model_json(model), "it"); }),
              HasSubstr("one level more than coefficients"));
}

ModelVersion straight_over_clip() {
  ModelVersion model{.version = 1, .explanation = "{}"};
  model.curves = {{.covariate = "clip",
                   .shape = CurveShape::kStraight,
                   .low = 0.1,
                   .high = 0.4,
                   .coefficients = {0.02},
                   .centre = {0.5}}};
  model.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-6);
  return model;
}

TEST(ApplyModel, ACurveOfAPlaceIsWeightedByIt) {
  ModelVersion model = straight_over_clip();
  model.curves[0].place = "tunnel";
  const CampaignData data = four_runs();
  const Reduction reduction = corrected(data, model_from_json(model_json(model), "it"));
  const auto ratio = [&](std::size_t run) {
    return reduction.runs[run].thrust_N[2] / *data.runs[run].thrust_N[2];
  };
  EXPECT_NEAR(ratio(0), std::exp(-0.02 * (-1 - 0.5)), 1e-12);
  EXPECT_EQ(ratio(3), 1) << "in open space";
  model.curves[0].place = "cellar";
  EXPECT_THAT(message_of([&] { model_from_json(model_json(model), "it"); }),
              HasSubstr("goes with the place cellar, which this program does not know"));
}

TEST(ApplyModel, ACurveOfTwoConditionsIsWeightedByTheOther) {
  ModelVersion model = straight_over_clip();
  model.curves[0].times = OtherCondition{"load", {.centre = 2, .scale = 4}, 0.1};
  CampaignData data = four_runs();
  for (auto& run : data.runs) run.numbers["load"] = 3;
  data.runs[1].numbers["load"] = 30;  // farther than any that the model has seen
  data.runs[3].numbers.erase("load");
  const ModelVersion read = model_from_json(model_json(model), "it");
  EXPECT_EQ(model_json(read), model_json(model));
  const Reduction reduction = corrected(data, read);
  const auto change = [&](std::size_t run) {
    return -std::log(reduction.runs[run].thrust_N[2] / *data.runs[run].thrust_N[2]) / 0.02;
  };
  EXPECT_NEAR(change(0), 0.25 * (-1 - 0.5) - 0.1, 1e-10);
  EXPECT_NEAR(change(1), *data.runs[1].number("clip") / 0.15 - 5. / 3 - 0.5 - 0.1, 1e-10);
  ASSERT_EQ(reduction.left_out.size(), 1u);
  EXPECT_THAT(reduction.left_out[0].reason, HasSubstr("no load, which the adopted curve over clip × load"));
  model.curves[0].times->strength.scale = 0;
  EXPECT_THAT(message_of([&] { model_from_json(model_json(model), "it"); }),
              HasSubstr("has a scale that is not above 0"));
}

TEST(ApplyModel, ARunWithoutTheCovariateIsLeftOutWithTheReason) {
  CampaignData data = four_runs();
  data.runs[1].numbers.erase("air_pressure_Pa");
  const Reduction reduction = corrected(data, model_of({term("air_pressure", {1}, {100000})}));
  EXPECT_EQ(reduction.runs.size(), 3u);
  ASSERT_EQ(reduction.left_out.size(), 1u);
  EXPECT_EQ(reduction.left_out[0].run, "R2");
  EXPECT_TRUE(reduction.left_out[0].problem);
  EXPECT_THAT(reduction.left_out[0].reason,
              HasSubstr("no air_pressure_Pa, which the adopted effect air_pressure"));
  for (tunnelrig::Run& run : data.runs) run.numbers.erase("air_pressure_Pa");
  EXPECT_THAT(message_of([&] { corrected(data, model_of({term("air_pressure", {1}, {100000})})); }),
              HasSubstr("no run can be reduced by model version 1 (air_pressure)"));
}

TEST(ApplyModel, ParametersEnterTheBudgetAsTheirDerivativesSay) {
  const CampaignData data = four_runs();
  const auto c_t = [&](double exponent) {
    return summarize_locations(data, corrected(data, model_of({term("air_pressure", {exponent}, {100000})})))
        .locations[0];
  };
  // ∂ log C_T/∂n = −log(p/101325), averaged over the two runs
  const LocationSummary at = c_t(0.8);
  const double slope = (c_t(0.81).c_t.mean - c_t(0.79).c_t.mean) / 0.02;
  EXPECT_NEAR(at.budget.model, std::abs(slope) * 1e-3, 1e-4 * at.budget.model);
  EXPECT_GT(at.budget.model, 0);
  EXPECT_EQ(summarize_locations(data, reduce_runs(data, {})).locations[0].budget.model, 0);
}

TEST(ApplyModel, AStepBeginsAtItsRunWhateverItsNumber) {
  ModelTerm step = term("propeller_step", {0.1, 2}, {0});
  step.first_run = "R3";
  const CampaignData data = four_runs();
  CampaignData fewer = data;
  fewer.runs.erase(fewer.runs.begin());
  const Reduction all = corrected(data, model_of({step})), three = corrected(fewer, model_of({step}));
  EXPECT_NEAR(all.runs[1].thrust_N[0], 7.9, 1e-9);
  EXPECT_NEAR(all.runs[2].thrust_N[0], 7.2 / 1.1, 1e-9);
  EXPECT_NEAR(three.runs[0].thrust_N[0], 7.9, 1e-9);
  EXPECT_NEAR(three.runs[1].thrust_N[0], 7.2 / 1.1, 1e-9);
  step.first_run = "R9";
  EXPECT_THAT(message_of([&] { corrected(data, model_of({step})); }), HasSubstr("begins at run R9"));
}

/// Steps and times since the motor's start count from none.
TEST(ModelVersion, SaysWhichConditionsItsCoefficientsAreFor) {
  const ModelVersion model =
      model_of({term("supply_voltage", {0.5}, {14.8}), term("reynolds_number", {0.1}, {5000, 21}),
                term("propeller_step", {0.1, 2}, {0}), term("motor_warm_up", {0.01, 60}, {100})});
  EXPECT_THAT(model.reference(),
              testing::ElementsAre(testing::Pair("air_temperature_C", 21), testing::Pair("speed_rpm", 5000),
                                   testing::Pair("supply_voltage_V", 14.8)));
}

TEST(ModelVersion, IsReadAsItWasWritten) {
  ModelTerm step = term("mounting_step", {0.01, 2}, {0}, 3);
  step.first_run = "R3";
  ModelVersion model = model_of({term("creep", {0.0123456789012345, 100}, {0.1}), step});
  model.curves = {
      {.covariate = "clip", .rotor = 1, .low = 0, .high = 0.8, .coefficients = {1}, .centre = {0}},
      {.covariate = "rpm",
       .shape = CurveShape::kLogParabola,
       .low = 1,
       .high = 2,
       .coefficients = {2},
       .centre = {0.3},
       .tilt = {0.1}},
      {.covariate = "volts",
       .shape = CurveShape::kLevelling,
       .low = 1,
       .high = 2,
       .coefficients = {3},
       .centre = {0.4},
       .place = "z_norm"}};
  model.covariance = 0.5 * Eigen::MatrixXd::Identity(7, 7);
  model.covariance(1, 0) = model.covariance(0, 1) = 1.0 / 3;
  const ModelVersion read = model_from_json(model_json(model), "m");
  EXPECT_EQ(model_json(read), model_json(model));
  EXPECT_EQ(read.covariance, model.covariance);
  EXPECT_EQ(read.parameters(), model.parameters());
  EXPECT_EQ(read.name(), model.name());
}

TEST(ModelVersion, BrokenDocumentsAreRefusedByName) {
  const std::string good = model_json(model_of({term("creep", {0.01, 100}, {90})}));
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    if (at == text.npos) return "no " + from;
    text.replace(at, from.size(), to);
    return message_of([&] { model_from_json(text, "c.db: the stored model (document 3)"); });
  };
  EXPECT_THAT(refusal("\"creep\"", "\"creeping\""),
              HasSubstr("(document 3), term 1 names the effect creeping, which this program does not have"));
  EXPECT_THAT(refusal("tunnelrig-model/1", "tunnelrig-model/9"),
              HasSubstr("has the format tunnelrig-model/9"));
  EXPECT_THAT(refusal("\"amplitude\"", "\"size\""), HasSubstr("term 1.parameters has no amplitude"));
  EXPECT_THAT(refusal("\"version\": 1", "\"version\": 0"), HasSubstr("has a version below 1"));
  EXPECT_THAT(refusal("\"version\": 1", "\"version\": \"1\""),
              HasSubstr("has a version that is no finite number"));
  EXPECT_THAT(refusal("\"rotor\": null", "\"rotor\": 9"), HasSubstr("has rotor 9"));
  EXPECT_THAT(refusal("\"covariance\": [", "\"covariance\": [[1],"),
              HasSubstr("covariance of 3 rows for 2 parameters"));
  EXPECT_THAT(refusal("\"parent\": 0", "\"parent\": 1"), HasSubstr("builds on version 1"));
  EXPECT_THAT(refusal("{", "["), HasSubstr("is no JSON"));
  EXPECT_THAT(message_of([] { model_from_json("[]", "x"); }), HasSubstr("x is no object"));
}

TEST(ModelVersion, ALogarithmOfWhatIsNotAboveZeroIsRefused) {
  ModelVersion model = model_of({});
  model.curves = {{.covariate = "rpm",
                   .shape = CurveShape::kLevelling,
                   .low = -1,
                   .high = 2,
                   .coefficients = {2},
                   .centre = {0.3}}};
  model.covariance = Eigen::MatrixXd::Identity(1, 1);
  EXPECT_THAT(message_of([&] { model_from_json(model_json(model), "m"); }),
              HasSubstr("has a shape over the logarithm, and a low that is not above 0"));
}

TEST(ModelVersion, AnyDamageIsAnswered) {
  const std::string good = model_json(model_of({term("creep", {0.01, 100}, {90})}));
  int refused = 0;
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const char byte : {'}', '0', '"', '\xff'}) {
      std::string text = good;
      text[at] = byte;
      refused += message_of([&] { model_from_json(text, "m"); }) == "no InputError was thrown" ? 0 : 1;
    }
    message_of([&] { model_from_json(good.substr(0, at), "m"); });
  }
  EXPECT_GT(refused, static_cast<int>(good.size()));
}

TEST(Adopt, OnlyThrustsOfACampaign) {
  Observations observations;
  observations.campaign = "a table";
  observations.response = "c_t";
  observations.baseline = "constant";
  EXPECT_THAT(message_of([&] { require_adoptable(observations); }), HasSubstr("explains c_t of a table"));
}

}  // namespace
}  // namespace tunnelrig
