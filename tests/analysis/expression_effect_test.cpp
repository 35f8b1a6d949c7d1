#include "analysis/effects/expression_effect.h"

#include "datasets/error.h"
#include "support/message_of.h"

#include <algorithm>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

const Effect& built_in(const std::string& name) {
  const auto& all = all_effects();
  return *std::find_if(all.begin(), all.end(), [&](const Effect& effect) { return effect.name == name; });
}

constexpr const char* kCreep = R"toml([[effects]]
name = "own_creep"
formula = "F * (1 + c * (1 - exp(-time_since_motor_start_s / tau)))"
physics = "as creep"
covariates = ["time_since_motor_start_s"]
scope = "rotor"
parameters = [
  {name = "c", lower = 0, upper = 0.5},
  {name = "tau", unit = "s", lower = 0.5, upper = 7200, grid = [10, 100, 1000]},
]
)toml";

/// The program's own creep, which differentiates by dual numbers, against the same as an expression.
TEST(ExpressionEffect, ValueAndDerivativesAreThoseOfTheSameFormulaCompiled) {
  const std::vector<Effect> own = parse_effects_toml(kCreep, "own.toml");
  const Effect& creep = built_in("creep");
  ASSERT_EQ(own.size(), 1u);
  EXPECT_EQ(own[0].scope, EffectScope::kRotor);
  EXPECT_TRUE(own[0].within_time());
  for (const double start_s : {1.0, 40.0, 900.0})
    for (const double c : {0.0, 0.01, 0.3})
      for (const double tau : {3.0, 120.0, 5000.0}) {
        const std::vector<double> x = {start_s};
        const Sample sample{.x = x, .reference = x, .time_s = 7};
        EffectJet p[kMaxEffectParameters] = {EffectJet(c, 0), EffectJet(tau, 1), EffectJet(0.0)};
        const EffectJet force(2.3, 2);
        const EffectJet mine = own[0].jet_N(sample, p, force), theirs = creep.jet_N(sample, p, force);
        EXPECT_NEAR(mine.a, theirs.a, 1e-12);
        for (int k = 0; k < kMaxEffectParameters; ++k)
          EXPECT_NEAR(mine.v[k], theirs.v[k], 1e-7 * std::max(1e-3, std::abs(theirs.v[k])) + 1e-9)
              << start_s << " " << c << " " << tau << " " << k;
        const double parameters[] = {c, tau};
        EXPECT_NEAR(own[0].force_N(sample, parameters, 2.3), theirs.a, 1e-12);
      }
}

struct Broken {
  const char *name, *from, *to, *message;
};

class BrokenEffects : public testing::TestWithParam<Broken> {};

TEST_P(BrokenEffects, AreNamedWithLineAndRule) {
  std::string text = kCreep;
  const std::string from = GetParam().from;
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, from.size(), GetParam().to);
  EXPECT_THAT(message_of([&] { parse_effects_toml(text, "own.toml"); }), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    All, BrokenEffects,
    testing::Values(
        Broken{"Toml", "scope = \"rotor\"", "scope = rotor", "own.toml:6: "},
        Broken{"NoName", "name = \"own_creep\"", "", "own.toml:1: an effect: name is required"},
        Broken{"ProgramsName", "own_creep", "creep", "own.toml:2: creep: name is that of a candidate"},
        Broken{"Scope", "\"rotor\"", "\"pair\"", "own.toml:6: own_creep: scope must be"},
        Broken{"Key", "scope", "scopes", "own.toml:6: own_creep: scopes is no key here"},
        Broken{"Syntax", "(1 - exp", "(1 - ) exp", "own.toml:3: F * "},
        Broken{"UnknownName", "/ tau", "/ tua", "own.toml:3: own_creep: formula has tua, which is neither"},
        Broken{"Unused", "start_s / tau", "start_s", "own.toml:3: own_creep: formula does not use tau"},
        Broken{"NotAbsentAtZero", "F * (1 + c", "F * (2 + c",
               "own.toml:3: own_creep: formula must give F where c is 0"},
        Broken{"AmplitudeWithoutZero", "lower = 0, upper = 0.5", "lower = 0.1, upper = 0.5",
               "own.toml:8: own_creep: parameter c: lower and upper must hold 0"},
        Broken{"BoundsReversed", "upper = 7200", "upper = 0.1",
               "own.toml:9: own_creep: parameter tau: upper must be above lower"},
        Broken{"NoGrid", ", grid = [10, 100, 1000]", "",
               "own.toml:9: own_creep: parameter tau: grid is required"},
        Broken{"GridOutside", "[10,", "[0.1,",
               "own.toml:9: own_creep: parameter tau: grid must be numbers within"},
        Broken{"NotANumber", "upper = 0.5", "upper = \"big\"",
               "own.toml:8: own_creep: parameter c: upper must be a number"},
        Broken{"Infinite", "upper = 0.5", "upper = inf",
               "own.toml:8: own_creep: parameter c: upper must be finite"},
        Broken{"TwoMeanings", "name = \"tau\"", "name = \"c\"",
               "own.toml:3: own_creep: formula has two meanings of c"}),
    [](const auto& broken) { return std::string(broken.param.name); });

TEST(ExpressionEffect, AFileWithoutEffectsIsRefused) {
  EXPECT_THAT(message_of([] { parse_effects_toml("", "own.toml"); }),
              HasSubstr("own.toml: has no [[effects]]"));
  const std::string twice = std::string(kCreep) + kCreep;
  EXPECT_THAT(message_of([&] { parse_effects_toml(twice, "own.toml"); }), HasSubstr("is there twice"));
}

}  // namespace
}  // namespace tunnelrig
