#include "attribution/scorer/metrics.h"
#include "datasets/error.h"

#include <gmock/gmock.h>

namespace tunnelrig::attribution {
namespace {

using nlohmann::json;

json key(const std::string& track, const std::vector<std::string>& effects, double size = 1,
         int blocks = 18) {
  json all = {{"track", track},
              {"size", size},
              {"design", {{"noise", "white"}, {"order", "randomised"}, {"blocks", blocks}, {"raw", false}}},
              {"effects", json::array()},
              {"acceptable", json::array()},
              {"noise_floor", {{"root_N", 0.018}, {"with_coefficients_N", 0.020}}}};
  for (const std::string& effect : effects) {
    all["effects"].push_back({{"effect", effect},
                              {"level", "run"},
                              {"covariates", {"relative_humidity"}},
                              {"parameters",
                               {{{"name", "amplitude"}, {"unit", "1"}, {"value", 0.01}},
                                {{"name", "tau"}, {"unit", "s"}, {"value", 100}}}}});
  }
  return all;
}

json adopted(const std::string& effect, const std::vector<std::string>& confounded = {}) {
  return {{"effect", effect},
          {"rotor", nullptr},
          {"parameters",
           {{"amplitude", {{"value", 0.011}, {"ci95", {0.009, 0.013}}, {"unit", "1"}}},
            {"time_constant", {{"value", 130}, {"ci95", {110, 150}}, {"unit", "s"}}}}},
          {"p_value", 0.001},
          {"held_out_gain", 0.1},
          {"confounded_with", confounded},
          {"separating_run", nullptr}};
}

json explanation(const std::vector<json>& found, const std::string& verdict = "explained") {
  const json errors = {{"rmse", 0.02}, {"held_out_rmse", 0.0205}, {"held_out_ci95", {0.018, 0.023}}};
  return {{"format", "tunnelrig-explain/1"},
          {"campaign", "c"},
          {"response", "thrust"},
          {"unit", "N"},
          {"baseline", "thesis"},
          {"verdict", verdict},
          {"noise_floor", 0.02},
          {"blocks", 18},
          {"runs", 215},
          {"before", errors},
          {"after", errors},
          {"adopted", found},
          {"unknown", json::array()},
          {"untestable", json::array()},
          {"suspect_rows", json::array()},
          {"detectable_at_80_percent_power", 0.01}};
}

Outcome outcome(const json& truth, const json& said, const json& separated = nullptr) {
  return parse_outcome(json{{"key", truth}, {"explain", said}, {"separated", separated}}.dump(), "line");
}

Metric metric(const std::vector<Outcome>& outcomes, const std::string& name) {
  for (const Metric& one : score(outcomes)) {
    if (one.name == name) return one;
  }
  ADD_FAILURE() << "no metric " << name;
  return {};
}

// Values of R's binom.test and of Wilson's formula.
TEST(Intervals, Known) {
  EXPECT_NEAR(clopper_pearson(0, 10).high, 0.3084971, 1e-6);
  EXPECT_NEAR(clopper_pearson(5, 10).low, 0.1870860, 1e-6);
  EXPECT_NEAR(clopper_pearson(5, 10).high, 0.8129140, 1e-6);
  EXPECT_NEAR(clopper_pearson(1000, 1000).low, 0.9963179, 1e-6);
  EXPECT_NEAR(wilson(5, 10).low, 0.2365931, 1e-6);
  EXPECT_NEAR(wilson(0, 10).high, 0.2775328, 1e-6);
  const std::vector<double> values = {1, 2, 3, 4};
  EXPECT_DOUBLE_EQ(mean_interval(values).mean, 2.5);
  EXPECT_NEAR(mean_interval(values).interval.high - 2.5, 1.959964 * std::sqrt(5.0 / 3 / 4), 1e-6);
}

TEST(Score, ANameWithoutEffectIsFalse) {
  const std::vector<Outcome> outcomes = {outcome(key("none", {}), explanation({})),
                                         outcome(key("none", {}), explanation({adopted("creep")}))};
  const Metric found = metric(outcomes, "no effect: a name given");
  EXPECT_EQ(found.successes, 1);
  EXPECT_EQ(found.count, 2);
  EXPECT_TRUE(found.met());  // two campaigns cannot refute 5 %
}

TEST(Score, OneEffect) {
  const std::vector<Outcome> outcomes = {
      outcome(key("one", {"creep"}), explanation({adopted("creep")})),
      outcome(key("one", {"creep"}), explanation({adopted("wake_recirculation", {"creep"})})),
      outcome(key("one", {"creep"}), explanation({adopted("creep"), adopted("axial_wind")})),
      outcome(key("one", {"creep"}), explanation({}, "no_structure")),
      outcome(key("one", {"creep"}, 0.5), explanation({adopted("creep")}))};
  EXPECT_EQ(metric(outcomes, "one effect, 1 sigma: truth in the set").successes, 3);
  EXPECT_EQ(metric(outcomes, "one effect, 1 sigma: truth in the set").count, 4);
  EXPECT_EQ(metric(outcomes, "one effect, 0.5 sigma: truth in the set").count, 1);
  EXPECT_EQ(metric(outcomes, "one effect, 1 sigma: named, nothing else").successes, 1);
}

TEST(Score, TwoEffects) {
  const std::vector<Outcome> outcomes = {
      outcome(key("two", {"creep", "axial_wind"}), explanation({adopted("axial_wind"), adopted("creep")})),
      outcome(key("two", {"creep", "axial_wind"}), explanation({adopted("axial_wind")})),
      outcome(key("two", {"creep", "axial_wind"}),
              explanation({adopted("axial_wind"), adopted("hysteresis", {"creep"})}))};
  EXPECT_EQ(metric(outcomes, "two effects, 1 sigma: both in sets").successes, 2);
  EXPECT_EQ(metric(outcomes, "two effects, 1 sigma: exactly those").successes, 1);
}

TEST(Score, OutsideTheLibrary) {
  json right = explanation({}, "unknown"), wrong = right;
  right["unknown"] = {{{"covariate", "relative_humidity"}}};
  wrong["unknown"] = {{{"covariate", "supply_voltage_V"}}};
  const json truth = key("outside", {"humidity_wave"});
  const std::vector<Outcome> outcomes = {outcome(truth, right), outcome(truth, wrong),
                                         outcome(truth, explanation({adopted("creep")}))};
  EXPECT_EQ(metric(outcomes, "outside, 1 sigma: a wrong name").successes, 1);
  EXPECT_EQ(metric(outcomes, "outside, 1 sigma: unknown, right covariate").successes, 1);
}

TEST(Score, ConfoundedPairs) {
  json truth = key("confounded", {"creep"});
  truth["acceptable"] = {"creep", "wake_recirculation"};
  const json both = explanation({adopted("wake_recirculation", {"creep"})}, "confounded");
  const std::vector<Outcome> outcomes = {
      outcome(truth, both, explanation({adopted("creep")})), outcome(truth, both, both),
      outcome(truth, both),  // no run was proposed
      outcome(truth, explanation({adopted("creep")}), explanation({adopted("creep")}))};
  EXPECT_EQ(metric(outcomes, "confounded pair: flagged").successes, 3);
  const Metric found = metric(outcomes, "confounded pair: resolved by the run");
  EXPECT_EQ(found.successes, 1);
  EXPECT_EQ(found.count, 3);
}

TEST(Score, ErrorsAndIntervals) {
  json wide = explanation({adopted("creep")});
  wide["after"]["held_out_rmse"] = 0.0225;
  const std::vector<Outcome> outcomes = {outcome(key("one", {"creep"}), explanation({adopted("creep")})),
                                         outcome(key("one", {"creep"}), wide)};
  const Metric ratio = metric(outcomes, "one effect: held-out error after / floor");
  EXPECT_NEAR(ratio.value, (1.025 + 1.125) / 2, 1e-12);
  EXPECT_NEAR(metric(outcomes, "one: floor / true floor").value, 1, 1e-12);
  // the amplitude's interval holds 0.01; the time constant's, of another name but the only one in seconds,
  // misses 100
  const Metric cover = metric(outcomes, "95 % intervals of parameters cover");
  EXPECT_EQ(cover.count, 4);
  EXPECT_EQ(cover.successes, 2);
  EXPECT_EQ(metric(outcomes, "95 % intervals of the error cover").successes, 2);
}

TEST(Score, FewBlocksAndFailures) {
  std::vector<Outcome> outcomes = {outcome(key("one", {"creep"}, 1, 5), explanation({}, "insufficient")),
                                   outcome(key("one", {"creep"}, 1, 4), explanation({adopted("creep")})),
                                   outcome(key("one", {"creep"}), nullptr)};
  const Metric few = metric(outcomes, "five blocks or fewer: insufficient");
  EXPECT_EQ(few.successes, 1);
  EXPECT_EQ(few.count, 2);
  EXPECT_FALSE(few.met());
  EXPECT_EQ(metric(outcomes, "explain failed").successes, 1);
  EXPECT_EQ(metric(outcomes, "one effect, 1 sigma: truth in the set").count, 1);  // a failure is no success
  EXPECT_EQ(metric(outcomes, "one effect, 1 sigma: truth in the set").successes, 0);
}

TEST(Contract, WhatIsMissingIsListed) {
  EXPECT_THAT(parse_explanation(explanation({adopted("creep")})).broken_rules, testing::IsEmpty());
  json broken = explanation({adopted("creep")});
  broken.erase("untestable");
  broken["noise_floor"] = nullptr;
  broken["after"]["held_out_ci95"] = {1};
  EXPECT_THAT(parse_explanation(broken).broken_rules,
              testing::UnorderedElementsAre("untestable is missing", "untestable is no list",
                                            "noise_floor is no finite number",
                                            "after.held_out_ci95 is no pair of numbers"));
  EXPECT_FALSE(parse_explanation(json::array()).broken_rules.empty());
}

TEST(Contract, AResultThatIsNoneIsNamed) {
  EXPECT_THROW(parse_outcome("{", "results.jsonl:3"), InputError);
  EXPECT_THROW(parse_outcome(R"({"key": {"track": 3}})", "results.jsonl:3"), InputError);
}

}  // namespace
}  // namespace tunnelrig::attribution
