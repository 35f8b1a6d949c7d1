// `tunnelrig explain` on simulated campaign folders.
#include "analysis/residual/explain_program.h"

#include <cmath>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using nlohmann::json;
using test::ExplainProgram;
using test::ProgramResult;
using test::SimulatedRun;
using testing::HasSubstr;
using testing::Not;

void sag(SimulatedRun& run) { run.thrust_factor = std::pow(run.supply_voltage_V / 16, 0.5); }

TEST_F(ExplainProgram, NamesAStrongEffect) {
  write_campaign(10, "", sag);
  import_campaign();
  const json e = explained();
  EXPECT_EQ(e["verdict"], "explained");
  ASSERT_EQ(e["adopted"].size(), 1u);
  EXPECT_EQ(e["adopted"][0]["effect"], "supply_voltage");
  EXPECT_TRUE(e["adopted"][0]["rotor"].is_null());
  EXPECT_NEAR(e["adopted"][0]["parameters"]["exponent"]["value"], 0.5, 0.05);
  EXPECT_EQ(e["unit"], "N");
  EXPECT_EQ(e["blocks"], 10);
  EXPECT_EQ(e["runs"], 90);
  EXPECT_THAT(text, HasSubstr("supply_voltage"));
  EXPECT_LT(e["after"]["held_out_rmse"], e["before"]["held_out_rmse"]);
}

TEST_F(ExplainProgram, FindsNothingWhereNothingIs) {
  write_campaign(10, "", [](SimulatedRun&) {});
  import_campaign();
  const json e = explained();
  EXPECT_EQ(e["verdict"], "no_structure");
  EXPECT_EQ(e["after"], e["before"]);
}

TEST_F(ExplainProgram, AColumnOfTextsIsACondition) {
  // "spare" is in one run only, which no one can tell from that run's scatter
  write_campaign(12, ",battery", [&](SimulatedRun& run) {
    run.extra = run.number == 50 ? ",spare" : std::vector<std::string>{",", ",red", ",blue"}[random() % 3];
    if (run.extra == ",red") run.thrust_factor = 0.985;
  });
  import_campaign();
  const json e = explained("--adopt-empirical --html e.html");
  EXPECT_EQ(e["verdict"], "unknown") << text;
  ASSERT_EQ(e["unknown"].size(), 1u);
  const json& battery = e["unknown"][0];
  EXPECT_EQ(battery["covariate"], "battery");
  EXPECT_EQ(battery["labels"], json({"", "blue", "red", "spare"}));
  ASSERT_EQ(battery["shape"].size(), 3u) << battery;
  EXPECT_EQ(battery["shape"][2][0], 3) << "red";
  EXPECT_NEAR(battery["shape"][2][1], -7 * 0.015 * 2 / 3, 0.02) << "against the mean of the three";
  EXPECT_THAT(text, HasSubstr("(empty) +0.0"));
  EXPECT_THAT(text, HasSubstr("red -0.0"));
  EXPECT_THAT(read_text(folder / "e.html"), HasSubstr("unknown: battery"));

  const ProgramResult reduced = run("reduce --db c.db");
  EXPECT_EQ(reduced.code, 1) << reduced.error;
  EXPECT_THAT(reduced.error,
              HasSubstr("R051 is left out: its battery is none that the adopted curve over battery"));
  const json again = explained("--response c_t");
  EXPECT_EQ(again["unknown"][0]["covariate"], "battery") << "explain holds measurements against the thesis";
}

TEST_F(ExplainProgram, WhatChangesWithAStepIsSaid) {
  write_campaign(14, ",battery", [](SimulatedRun& run) {
    run.extra = run.session < 7 ? ",A" : ",B";
    if (run.session >= 7) run.thrust_factor = 0.98;
  });
  import_campaign();
  const json e = explained();
  ASSERT_EQ(e["adopted"].size(), 1u) << text;
  const std::string step = e["adopted"][0]["effect"];
  EXPECT_THAT(step, testing::AnyOf("propeller_step", "mounting_step")) << "forces are nearly the same";
  EXPECT_THAT(warnings, HasSubstr("battery changes at run R064, where " + step + " may have happened"));
  EXPECT_THAT(warnings, Not(HasSubstr("supply_voltage_V changes")));
}

TEST_F(ExplainProgram, TheHourOfTheDayIsToldFromTheHourOfTheSession) {
  first_hour = [](int session) { return 1 + session * 5 % 13; };
  write_campaign(14, "", [](SimulatedRun& run) { run.thrust_factor = 1 + 0.006 * std::sin(run.hour / 3.0); });
  import_campaign();
  const json e = explained("--adopt-empirical");
  EXPECT_EQ(e["verdict"], "unknown") << text;
  ASSERT_GE(e["unknown"].size(), 1u);
  EXPECT_EQ(e["unknown"][0]["covariate"], "start_utc") << "the column that it is made of";
  EXPECT_EQ(e["unknown"][0]["covariate_unit"], "h of the day");
  EXPECT_NEAR(e["unknown"][0]["amplitude"], 7 * 0.006, 0.015);
  EXPECT_THAT(text, HasSubstr("start_utc [h of the day]"));
  EXPECT_EQ(run("reduce --db c.db").code, 0);
}

TEST_F(ExplainProgram, ARunWithARotorThatPushesIsLeftOutAndSaid) {
  write_campaign(10, "", [](SimulatedRun& run) {
    sag(run);
    if (run.number == 40) run.first_rotor_factor = -1;
  });
  import_campaign();
  const json e = explained();
  EXPECT_EQ(e["runs"], 89);
  EXPECT_THAT(warnings, HasSubstr("R041: thrust is -"));
  EXPECT_EQ(e["verdict"], "explained");
}

/// The supply and the thrust go together, but nothing goes with the supply but itself.
TEST_F(ExplainProgram, AColumnIsNotExplainedByItself) {
  write_campaign(10, "", sag);
  import_campaign();
  const json e = explained("--response supply_voltage_V");
  EXPECT_EQ(e["verdict"], "no_structure") << text;
}

TEST_F(ExplainProgram, AFewSessionsAreInsufficient) {
  for (const int sessions : {1, 5}) {
    write_campaign(sessions, "", sag);
    import_campaign();
    const json e = explained();
    EXPECT_EQ(e["verdict"], "insufficient");
    EXPECT_EQ(e["blocks"], sessions);
    EXPECT_GT(e["before"]["rmse"], 0);
    EXPECT_EQ(e["after"], e["before"]);
    EXPECT_THAT(warnings, HasSubstr("too few"));
  }
}

TEST_F(ExplainProgram, ALabelSaysHowFarTheGroundIs) {
  locations = {"OS", "GND1", "GND2"};
  write_campaign(10, "", [](SimulatedRun& run) {
    const double height_R = run.number % 3;
    if (height_R > 0) run.thrust_factor = 1 / (1 - std::pow(4 * height_R, -2));
  });
  import_campaign();
  const json e = explained("--baseline open_space");
  EXPECT_EQ(e["verdict"], "explained");
  ASSERT_EQ(e["adopted"].size(), 1u);
  EXPECT_EQ(e["adopted"][0]["effect"], "ground_effect");

  locations = {"OT", "H1V1", "H2V0"};
  write_campaign(10, "", sag);
  import_campaign();
  const ProgramResult refused = run("explain --db c.db --baseline open_space");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.error, HasSubstr("no run stands at OS"));
}

TEST_F(ExplainProgram, AMissingCovariateIsWarnedOfAndUntestable) {
  write_campaign(10, ",relative_humidity", [&](SimulatedRun& run) {
    run.extra = run.number % 10 == 3 ? "," : fmt::format(",{:.3f}", 0.3 + 0.004 * (run.number * 37 % 100));
  });
  import_campaign();
  const json e = explained();
  const json entry = untestable(e, "air_humidity");
  ASSERT_FALSE(entry.is_null());
  EXPECT_THAT(entry["reason"].get<std::string>(), HasSubstr("relative_humidity is missing in 9 of 90 runs"));
  EXPECT_THAT(warnings,
              HasSubstr("relative_humidity is missing in 9 of 90 runs: what goes with it cannot be seen"));
  EXPECT_EQ(e["runs"], 90) << "no row is dropped";
}

TEST_F(ExplainProgram, AConstantCovariateIsWarnedOfAndUntestable) {
  write_campaign(10, ",excitation_voltage_V", [&](SimulatedRun& run) { run.extra = ",5"; });
  import_campaign();
  const json entry = untestable(explained(), "excitation_voltage");
  ASSERT_FALSE(entry.is_null());
  EXPECT_THAT(entry["reason"].get<std::string>(), HasSubstr("does not vary"));
  EXPECT_THAT(warnings, HasSubstr("excitation_voltage_V"));
}

TEST_F(ExplainProgram, CollinearCovariatesAreWarnedOf) {
  write_campaign(10, ",adc_reference_V",
                 [&](SimulatedRun& run) { run.extra = fmt::format(",{:.5f}", run.supply_voltage_V / 5); });
  import_campaign();
  const json e = explained();
  EXPECT_THAT(warnings, HasSubstr("go together"));
  EXPECT_THAT(untestable(e, "reference_drift")["reason"].get<std::string>(), HasSubstr("collinear"));
}

TEST_F(ExplainProgram, KelvinInACelsiusColumnIsRefused) {
  write_campaign(8, "", [&](SimulatedRun& run) { run.air_temperature_C = 293; });
  const ProgramResult imported = run("import campaign --db c.db");
  EXPECT_EQ(imported.code, 2);
  EXPECT_THAT(imported.error, HasSubstr("air_temperature_C"));
  EXPECT_THAT(imported.error, HasSubstr("not kelvin"));
}

TEST_F(ExplainProgram, AResponseThatCannotBeExplainedIsRefused) {
  write_campaign(8, ",flat,hollow", [](SimulatedRun& run) { run.extra = ",3.5,"; });
  import_campaign();
  const ProgramResult flat = run("explain --db c.db --response flat");
  EXPECT_EQ(flat.code, 2);
  EXPECT_THAT(flat.error, HasSubstr("same in every run"));
  const ProgramResult hollow = run("explain --db c.db --response hollow");
  EXPECT_EQ(hollow.code, 2);
  EXPECT_THAT(hollow.error, HasSubstr("hollow"));
  const ProgramResult unheard = run("explain --db c.db --response unheard_of");
  EXPECT_EQ(unheard.code, 2);
  EXPECT_THAT(unheard.error, HasSubstr("unheard_of"));
  EXPECT_EQ(run("explain --db c.db --baseline guess").code, 2);
  EXPECT_EQ(run("explain --db c.db --alpha 2").code, 2);
  const ProgramResult too_few = run("explain --db c.db --alpha 0.001 --simulations 199");
  EXPECT_EQ(too_few.code, 2);
  EXPECT_THAT(too_few.error, HasSubstr("--alpha 0.001 needs --simulations 999 at least"));
  EXPECT_EQ(run("explain --db nosuch.db").code, 2);
  EXPECT_EQ(run("explain").code, 2);
}

TEST_F(ExplainProgram, ListsCandidatesWithoutACampaign) {
  const ProgramResult list = run("explain --list");
  EXPECT_EQ(list.code, 0);
  for (const char* part : {"creep", "supply_voltage", "needs: supply_voltage_V", "from 0 to 4"})
    EXPECT_THAT(list.out, HasSubstr(part));
  write_campaign(8, "", sag);
  import_campaign();
  const ProgramResult here = run("explain --list --db c.db");
  EXPECT_EQ(here.code, 0);
  EXPECT_THAT(here.out, HasSubstr("not testable: not recorded: cable_force_N"));
  EXPECT_EQ(run("explain --list --db c.db --json list.json").out, "");
  EXPECT_TRUE(json::parse(read_text(folder / "list.json"))[0].contains("testable"));
}

}  // namespace
}  // namespace tunnelrig
