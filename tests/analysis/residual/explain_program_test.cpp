// `tunnelrig explain` as a person runs it, on simulated campaign folders and tables.
#include "cli/program.h"
#include "datasets/csv.h"
#include "support/example_campaign.h"
#include "support/seeds.h"
#include "support/temporary_folder.h"

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using nlohmann::json;
using test::ProgramResult;
using testing::HasSubstr;
using testing::Not;

/// One run of a simulated campaign; `extra` are further cells of runs.csv.
struct SimulatedRun {
  int number = 0, session = 0, hour = 0;  // the latter of the day
  double supply_voltage_V = 16, air_temperature_C = 20;
  double thrust_factor = 1, first_rotor_factor = 1;
  std::string extra;
};

struct ExplainProgram : testing::Test {
  test::TemporaryFolder folder;
  std::mt19937_64 random{test::seed()};

  std::function<int(int session)> first_hour = [](int) { return 8; };
  std::array<const char*, 3> locations = {"OT", "H1V1", "H2V0"};  // in turn

  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(random); }

  /// Runs given by their thrusts at three locations; `change` sets what differs.
  void write_campaign(int sessions, const std::string& extra_columns,
                      const std::function<void(SimulatedRun&)>& change) {
    test::ExampleCampaign campaign;
    campaign.runs_csv =
        "run,location,repeat,session,start_utc,raw,speed_rpm,air_temperature_C,supply_voltage_V" +
        extra_columns + ",thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N\n";
    int number = 0;
    for (int session = 0; session < sessions; ++session) {
      const double offset = normal(0.001);
      for (int i = 0; i < 9; ++i, ++number) {
        SimulatedRun run{.number = number, .session = session, .hour = first_hour(session) + i};
        run.supply_voltage_V = 16 + std::uniform_real_distribution<double>(-0.5, 0.5)(random);
        change(run);
        const double density = 293.15 / (run.air_temperature_C + 273.15);
        campaign.runs_csv +=
            fmt::format("R{:03},{},{},S{:02},2026-03-{:02}T{:02}:00:00Z,,5000,{:.2f},{:.4f}{}", number + 1,
                        locations[static_cast<std::size_t>(i % 3)], number / 3 + 1, session + 1, session + 1,
                        run.hour, run.air_temperature_C, run.supply_voltage_V, run.extra);
        for (int rotor = 0; rotor < 4; ++rotor)
          campaign.runs_csv += fmt::format(",{:.5f}", 7 * density * run.thrust_factor *
                                                          (rotor == 0 ? run.first_rotor_factor : 1) *
                                                          (1 + offset + normal(0.002)));
        campaign.runs_csv += "\n";
      }
    }
    campaign.write(folder / "campaign", 10);
  }

  ProgramResult run(const std::string& arguments) const {
    return test::run_program(folder.path(), arguments);
  }
  void import_campaign() {
    const ProgramResult imported = run("import campaign --db c.db --replace");
    ASSERT_EQ(imported.code, 0) << imported.error;
    ASSERT_NE(run("calibrate --db c.db").code, 2);
  }
  json explained(const std::string& arguments = "") {
    const ProgramResult result = run("explain --db c.db --simulations 199 --json e.json " + arguments);
    EXPECT_EQ(result.code, 0) << result.error;
    warnings = result.error;
    text = result.out;
    return json::parse(read_text(folder / "e.json"));
  }
  static json untestable(const json& explanation, const std::string& effect) {
    for (const json& entry : explanation["untestable"])
      if (entry["effect"] == effect) return entry;
    return nullptr;
  }
  std::string warnings, text;
};

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
  EXPECT_EQ(e["adopted"][0]["effect"], "propeller_step");
  EXPECT_THAT(warnings, HasSubstr("battery changes at run R064, where propeller_step may have happened"));
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
}

// --- tables

struct ExplainTable : ExplainProgram {
  std::string schema = "format = \"tunnelrig-table/1\"\nname = \"t\"\ngroups = [\"g\"]\nblocks = \"day\"\n";
  std::string response = "[response]\ncolumn = \"F\"\nunit = \"N\"\n";
  std::string covariates =
      "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"
      "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n";

  void write_table(const std::function<std::string(double force)>& cell, double temperature_C = 20) {
    std::string csv = "g,day,F,V,T\n";
    for (int row = 0; row < 80; ++row) {
      const double volts = std::uniform_real_distribution<double>(15, 17)(random);
      const double force = 5 * std::pow(volts / 16, 0.8) * (1 + normal(0.003));
      csv += fmt::format("g{},d{},{},{:.4f},{:.2f}\n", row % 2, row / 8, cell(force), volts,
                         temperature_C + normal(1));
    }
    write_text(folder / "t.csv", csv);
    write_text(folder / "t.toml", schema + response + covariates);
  }
  ProgramResult import_table() const {
    return run("import t.csv --format table --schema t.toml --db c.db --replace");
  }
};

std::string plain(double force) { return fmt::format("{:.5f}", force); }

TEST_F(ExplainTable, NamesAStrongEffect) {
  write_table(plain);
  ASSERT_EQ(import_table().code, 0);
  const json e = explained();
  EXPECT_EQ(e["verdict"], "explained");
  ASSERT_EQ(e["adopted"].size(), 1u);
  EXPECT_EQ(e["adopted"][0]["effect"], "supply_voltage");
  EXPECT_EQ(e["response"], "F");
}

/// What goes with the force itself is drawn over that, run order or not.
TEST_F(ExplainTable, AZeroThatWasNotTakenOffIsDrawnOverTheForce) {
  std::string csv = "day,N,F\n";
  for (int row = 0; row < 80; ++row) {
    const double rpm = std::uniform_real_distribution<double>(3000, 7000)(random);
    csv += fmt::format("d{},{:.1f},{:.5f}\n", row / 8, rpm,
                       (6 * std::pow(rpm / 5000, 2) + 0.08) * (1 + normal(0.002)));
  }
  write_text(folder / "t.csv", csv);
  write_text(folder / "t.toml",
             "format = \"tunnelrig-table/1\"\nname = \"t\"\nblocks = \"day\"\n[response]\ncolumn = \"F\"\n"
             "unit = \"N\"\nmeaning = \"thrust_N\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n"
             "[propeller]\ndiameter_m = 0.25\n");
  ASSERT_EQ(import_table().code, 0);
  const json e = explained("--html e.html");
  ASSERT_EQ(e["adopted"].size(), 1u);
  EXPECT_EQ(e["adopted"][0]["effect"], "zero_offset");
  EXPECT_THAT(read_text(folder / "e.html"), HasSubstr(R"("covariate":"predicted F","covariate_unit":"N")"));
}

TEST_F(ExplainTable, ConstantOrEmptyResponsesAreRefused) {
  write_table([](double) { return "5"; });
  ASSERT_EQ(import_table().code, 0);
  const ProgramResult constant = run("explain --db c.db");
  EXPECT_EQ(constant.code, 2);
  EXPECT_THAT(constant.error, HasSubstr("same in every row"));
  for (const char* nothing : {"", "nan"}) {
    write_table([&](double) { return nothing; });
    const ProgramResult refused = import_table();
    EXPECT_EQ(refused.code, 2) << nothing;
    EXPECT_THAT(refused.error, HasSubstr("t.csv:2"));
  }
}

TEST_F(ExplainTable, KelvinInACelsiusColumnIsRefused) {
  write_table(plain, 293);
  const ProgramResult refused = import_table();
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.error, HasSubstr("t.csv:2"));
  EXPECT_THAT(refused.error, HasSubstr("kelvin"));
}

TEST_F(ExplainTable, MistakesInHoldOutNameFileAndExpression) {
  for (const auto& [expression, reason] :
       std::vector<std::pair<std::string, std::string>>{{"V > ", "V > "},
                                                        {"nosuch > 3", "nosuch"},
                                                        {"V > 1000", "all rows or none"},
                                                        {"rank(V", "rank("}}) {
    schema =
        "format = \"tunnelrig-table/1\"\nname = \"t\"\ngroups = [\"g\"]\nblocks = \"day\"\nhold_out = \"" +
        expression + "\"\n";
    write_table(plain);
    const ProgramResult imported = import_table();
    const ProgramResult refused = imported.code == 0 ? run("explain --db c.db") : imported;
    EXPECT_EQ(refused.code, 2) << expression;
    EXPECT_THAT(refused.error, HasSubstr(reason));
  }
}

TEST_F(ExplainTable, HoldOutIsWhatIsScored) {
  schema += "hold_out = \"rank(V) > 0.7\"\n";
  write_table(plain);
  ASSERT_EQ(import_table().code, 0);
  const json e = explained();
  ASSERT_EQ(e["adopted"].size(), 1u);
  EXPECT_EQ(e["adopted"][0]["effect"], "supply_voltage");
  EXPECT_GT(e["before"]["held_out_rmse"], 2 * e["before"]["rmse"].get<double>()) << "beyond what was fitted";
  EXPECT_LT(e["after"]["held_out_rmse"], 0.03);
}

TEST_F(ExplainTable, BaselinesAreColumns) {
  write_table(plain);
  ASSERT_EQ(import_table().code, 0);
  EXPECT_EQ(explained("--baseline power:V")["verdict"], "no_structure") << "the baseline has it already";
  EXPECT_EQ(explained("--baseline linear:V")["unit"], "N");
  EXPECT_EQ(run("explain --db c.db --baseline power:nosuch").code, 2);
  EXPECT_EQ(run("explain --db c.db --baseline cubic:V").code, 2);
}

TEST_F(ExplainTable, ARowOfTheOtherSignHasNoPower) {
  int row = 0;
  write_table([&row](double force) { return fmt::format("{}", row++ == 4 ? -force : force); });
  ASSERT_EQ(import_table().code, 0);
  const ProgramResult refused = run("explain --db c.db --baseline power:V");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.error, HasSubstr("t.csv:6: --baseline power:V: the response must have one sign"));
}

}  // namespace
}  // namespace tunnelrig
