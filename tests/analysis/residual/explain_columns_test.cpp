// Columns of the user's own, and designs, that nothing can be told from: each has its reason.
#include "analysis/residual/explain_program.h"

#include <array>
#include <cmath>
#include <vector>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using nlohmann::json;
using test::ExplainProgram;
using test::ProgramResult;
using test::SimulatedRun;
using testing::HasSubstr;
using testing::Not;

struct ExplainColumns : ExplainProgram {
  /// Of structure over a column; empty: no such entry.
  static std::string structure(const json& explanation, const std::string& column) {
    for (const json& entry : explanation["untestable"])
      if (entry["effect"] == "structure" && entry["missing"] == json::array({column})) return entry["reason"];
    return "";
  }
  std::string refusal(const std::string& arguments) {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_EQ(result.out, "") << arguments;
    return result.error;
  }
};

TEST_F(ExplainColumns, WhatNoEffectNeedsIsUntestableStructure) {
  write_campaign(10, ",fan,gappy,left,right", [&](SimulatedRun& run) {
    const double wander = normal(1);
    run.extra = fmt::format(",7,{},{:.4f},{:.4f}", run.number % 5 == 1 ? "" : fmt::format("{}", normal(1)),
                            wander, 3 - 2 * wander);
    run.thrust_factor = 1 + 0.006 * std::sin(2 * wander);
  });
  import_campaign();
  const json e = explained();
  EXPECT_EQ(structure(e, "fan"), "fan is the same in every run");
  EXPECT_EQ(structure(e, "gappy"), "gappy is missing in 18 of 90 runs");
  EXPECT_THAT(structure(e, "left"), HasSubstr("left is collinear with right"));
  EXPECT_THAT(structure(e, "right"), HasSubstr("right is collinear with left"));
  EXPECT_EQ(structure(e, "supply_voltage_V"), "") << "effects need it";
  for (const char* said : {"fan is the same", "gappy is missing", "left and right go together"})
    EXPECT_THAT(warnings, HasSubstr(said));
  EXPECT_THAT(text, HasSubstr("fan is the same in every run: structure"));
  EXPECT_EQ(e["runs"], 90);
  ASSERT_EQ(e["unknown"].size(), 1u) << text;
  const bool left = e["unknown"][0]["covariate"] == "left";
  EXPECT_EQ(e["unknown"][0]["collinear_with"], json::array({left ? "right" : "left"}));
  EXPECT_THAT(text, HasSubstr(left ? "not to be told from right" : "not to be told from left"));
}

TEST_F(ExplainColumns, RunsWithoutAnAirTemperatureAreSaidOnce) {
  write_campaign(10, "", [](SimulatedRun&) {});
  std::string csv = read_text(folder / "campaign/runs.csv");
  for (int number : {3, 14, 25, 36, 47, 58}) {
    const auto row = csv.find(fmt::format("R{:03},", number));
    const auto cell = csv.find(",20.00,", row);
    csv.erase(cell + 1, 5);
  }
  write_text(folder / "campaign/runs.csv", csv);
  import_campaign();
  const json e = explained();
  EXPECT_EQ(e["runs"], 84);
  EXPECT_THAT(warnings,
              HasSubstr("6 runs are left out (R003, R014, R025 and 3 more): air_temperature_C was not "
                        "recorded"));
  EXPECT_THAT(warnings, Not(HasSubstr("R003: ")));
  EXPECT_THAT(structure(e, "air_temperature_C"), HasSubstr("missing in 6 of 90 runs, which are left out"));
}

/// A location's coefficient takes all that its only session did.
TEST_F(ExplainColumns, LocationsOfOneSessionEachAreInsufficient) {
  std::array<std::string, 12> own;
  for (std::size_t s = 0; s < own.size(); ++s) own[s] = fmt::format("H{}V{}", s % 4, s / 4);
  write_campaign(
      12, "", [&](SimulatedRun& run) { locations.fill(own[static_cast<std::size_t>(run.session)].c_str()); });
  import_campaign();
  const json e = explained();
  EXPECT_EQ(e["verdict"], "insufficient");
  EXPECT_EQ(e["after"], e["before"]);
  EXPECT_GT(e["before"]["rmse"], 0);
  EXPECT_THAT(warnings, HasSubstr("each location has runs in one block only"));
}

TEST_F(ExplainColumns, NamesThatMeanSomethingElseAreSaid) {
  write_campaign(10, ",time_in_run,thrust",
                 [&](SimulatedRun& run) { run.extra = fmt::format(",{},{}", normal(1), normal(1)); });
  import_campaign();
  const json e = explained();
  EXPECT_THAT(warnings, HasSubstr("the column time_in_run is not read"));
  EXPECT_THAT(warnings, HasSubstr("the column thrust is read as a condition"));
  EXPECT_THAT(refusal("explain --db c.db --response location"), HasSubstr("location is read as text"));
  EXPECT_THAT(refusal("explain --db c.db --response battery"), HasSubstr("has no battery"));
}

TEST_F(ExplainColumns, WhatAListDoesNotDoIsRefused) {
  for (const char* option : {"--html l.html", "--adopt", "--adopt-empirical", "--alpha 0.1", "--seed 3"})
    EXPECT_THAT(refusal(fmt::format("explain --list {}", option)), HasSubstr("--list prints the candidates"));
  EXPECT_THAT(refusal("explain --list --response cell"), HasSubstr("it goes with --db"));
  EXPECT_THAT(refusal("explain --db c.db --html -"), HasSubstr("--html -"));
}

/// What is stored already is not stored again, and explain says whose model is in force.
TEST_F(ExplainColumns, AdoptingTheSameAgainStoresNothing) {
  write_campaign(10, "",
                 [](SimulatedRun& run) { run.thrust_factor = std::pow(run.supply_voltage_V / 16, 0.5); });
  import_campaign();
  EXPECT_EQ(explained("--adopt")["model_in_force"], 0);
  EXPECT_THAT(warnings, HasSubstr("stored as model version 1"));
  const json again = explained("--adopt");
  EXPECT_EQ(again["model_in_force"], 1);
  EXPECT_THAT(text, HasSubstr("model version 1 is in force for reduce"));
  EXPECT_EQ(again["adopted"][0]["effect"], "supply_voltage");
  EXPECT_THAT(warnings, HasSubstr("the same as model version 1 (supply_voltage): nothing is stored"));
  const json models = json::parse(run("models --db c.db --json").out);
  EXPECT_EQ(models["versions"].size(), 2u) << "thesis and 1";
  for (const json& version : models["versions"])
    if (version["version"] != 0) {
      EXPECT_EQ(version["created_utc"].get<std::string>().size(), std::string("2026-03-02T08:00:00Z").size());
    }
}

struct OwnEffects : ExplainColumns {
  void SetUp() override {
    write_campaign(14, ",dust", [&](SimulatedRun& run) {
      const double dust = std::uniform_real_distribution<double>(0, 10)(random);
      run.extra = fmt::format(",{:.4f}", dust);
      run.thrust_factor = 1 - 0.03 * std::exp(-dust / 3);
    });
    import_campaign();
  }
  json explained_by(const std::string& formula, const std::string& parameters) {
    write_text(folder / "own.toml", "[[effects]]\nname = \"belt\"\nphysics = \"dust\"\nformula = \"" +
                                        formula + "\"\ncovariates = [\"dust\"]\nparameters = [" + parameters +
                                        "]\n");
    return explained("--effects own.toml");
  }
};

/// Of the values in a grid one may have none, and another be found.
TEST_F(OwnEffects, IsTriedWhereOneOfItsWaysHasAValue) {
  const json e = explained_by(
      "F*(1+c*exp(-dust/tau)/(tau > 1e-9))",
      "{name = \"c\", lower = -0.2, upper = 0.2}, {name = \"tau\", lower = 0, upper = 100, grid = [0, 3]}");
  ASSERT_EQ(e["adopted"].size(), 1u) << text;
  EXPECT_EQ(e["adopted"][0]["effect"], "belt");
  EXPECT_TRUE(untestable(e, "belt").is_null());
  EXPECT_THAT(warnings, Not(HasSubstr("is not tried")));
}

TEST_F(OwnEffects, SaysThatItIsFlatWhereItIsAbsent) {
  const json e = explained_by("F*(1+c^2*dust)", "{name = \"c\", lower = -0.2, upper = 0.2}");
  EXPECT_THAT(untestable(e, "belt")["reason"].get<std::string>(),
              HasSubstr("its derivative by c is 0 where c is 0"));
}

}  // namespace
}  // namespace tunnelrig
