// A unit mistake is said by every verb that can see it, from the import on.
#include "cli/program.h"
#include "datasets/csv.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using test::ProgramResult;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct UnitMistakes : testing::Test {
  test::TemporaryFolder folder;

  ProgramResult run(const std::string& arguments) const {
    return test::run_program(folder.path(), arguments);
  }

  /// The example, its calibration's forces (of one cell, or all) times `factor`.
  ProgramResult import_with_forces_times(double factor, const std::string& of_cell = "") const {
    test::ExampleCampaign campaign;
    const Sheet sheet = parse_csv(campaign.calibration_csv, "calibration.csv");
    campaign.calibration_csv = "cell,applied_force_N,voltage_V\n";
    for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
      const std::string cell = sheet.text(row, "cell");
      const double times = of_cell.empty() || cell == of_cell ? factor : 1;
      campaign.calibration_csv +=
          fmt::format("{},{},{}\n", cell, times * sheet.require_number(row, "applied_force_N"),
                      sheet.text(row, "voltage_V"));
    }
    campaign.write(folder / "source");
    return run("import source --db c.db");
  }
};

TEST_F(UnitMistakes, ASoundCampaignIsNotDoubted) {
  const ProgramResult imported = import_with_forces_times(1);
  EXPECT_EQ(imported.code, 0);
  EXPECT_EQ(imported.error, "");
  EXPECT_THAT(run("calibrate --db c.db").out, Not(HasSubstr("(not ")));
  const ProgramResult reduced = run("reduce --db c.db");
  EXPECT_EQ(reduced.code, 0) << reduced.error;
  EXPECT_THAT(reduced.error, Not(HasSubstr("a rotor of")));
  EXPECT_THAT(run("doctor --db c.db").out, Not(HasSubstr("thrusts")));
}

TEST_F(UnitMistakes, ACalibrationInGrams) {
  const ProgramResult imported = import_with_forces_times(1000 / 9.80665);
  EXPECT_EQ(imported.code, 0);
  EXPECT_THAT(imported.error, HasSubstr("are these newtons (not grams)?"));
  const auto for_machines = nlohmann::json::parse(run("import source --db c.db --replace --json").out);
  EXPECT_THAT(for_machines["doubts"].dump(), HasSubstr("are these newtons (not grams)?"));
  EXPECT_THAT(run("calibrate --db c.db").out, AllOf(HasSubstr("Warnings"), HasSubstr("(not grams)?")));
  const ProgramResult reduced = run("reduce --db c.db");
  EXPECT_EQ(reduced.code, 1);
  EXPECT_THAT(reduced.error, HasSubstr("gives 83.6 N at most at 5000 rev/min (so at 3 of 3 locations)"));
  const ProgramResult doctor = run("doctor --db c.db");
  EXPECT_EQ(doctor.code, 1);
  EXPECT_THAT(doctor.out, HasSubstr("problem  thrusts"));
}

/// What the points do not show, the thrusts do.
TEST_F(UnitMistakes, ACalibrationInKilograms) {
  EXPECT_EQ(import_with_forces_times(1 / 9.80665).error, "");
  EXPECT_EQ(run("calibrate --db c.db").code, 0);
  const ProgramResult reduced = run("reduce --db c.db");
  EXPECT_EQ(reduced.code, 0) << "a rig at rest gives as little";
  EXPECT_THAT(reduced.error, HasSubstr("no rotor gives more anywhere"));
  const ProgramResult doctor = run("doctor --db c.db");
  EXPECT_EQ(doctor.code, 0);
  EXPECT_THAT(doctor.out, HasSubstr("note     thrusts"));
}

TEST_F(UnitMistakes, ACellOfTheWrongSign) {
  EXPECT_EQ(import_with_forces_times(-1, "1").code, 0);
  run("calibrate --db c.db");
  const auto said = AllOf(HasSubstr("rotor 1 gives -"), HasSubstr("with the wrong sign?"));
  const ProgramResult reduced = run("reduce --db c.db");
  EXPECT_EQ(reduced.code, 1);
  EXPECT_THAT(reduced.error, said);
  const ProgramResult doctor = run("doctor --db c.db");
  EXPECT_EQ(doctor.code, 1);
  EXPECT_THAT(doctor.out, said);
}

TEST_F(UnitMistakes, ATableWhoseDiameterIsInAnotherUnit) {
  write_text(folder / "t.csv", "N,T\n5000,2.9\n6000,4.2\n7000,5.7\n");
  const auto reduce_with = [&](const char* diameter_m) {
    write_text(folder / "t.toml",
               fmt::format("format = \"tunnelrig-table/1\"\nname = \"t\"\nblocks = \"rows\"\n"
                           "[response]\ncolumn = \"T\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                           "[speed]\ncolumn = \"N\"\nunit = \"rev/min\"\n[propeller]\ndiameter_m = {}\n"
                           "[air]\ntemperature_C = 20\npressure_Pa = 101325\n",
                           diameter_m));
    const ProgramResult imported = run("import t.csv --format table --schema t.toml --db t.db --replace");
    EXPECT_EQ(imported.code, 0) << imported.error;
    return run("reduce --db t.db");
  };
  const ProgramResult sound = reduce_with("0.2286");
  EXPECT_EQ(sound.code, 0) << sound.error;
  const ProgramResult inches = reduce_with("9");
  EXPECT_EQ(inches.code, 0);
  EXPECT_THAT(inches.error, HasSubstr("is less than any propeller's"));
  const ProgramResult centimetres = reduce_with("0.09");
  EXPECT_EQ(centimetres.code, 1) << "more than any propeller's is no rig at rest";
  const ProgramResult for_machines = run("reduce --db t.db --json");
  EXPECT_EQ(for_machines.code, 1) << "as without --json";
  EXPECT_EQ(for_machines.error, centimetres.error);
  EXPECT_TRUE(nlohmann::json::accept(for_machines.out)) << for_machines.out;
}

/// A doubt is a warning: what was written is stored.
TEST_F(UnitMistakes, ASessionInAnotherUnit) {
  test::ExampleCampaign campaign;
  campaign.runs_csv.replace(campaign.runs_csv.find(",18.0\n"), 6, ",68.5\n");
  campaign.runs_csv += "R4,OS,2,S3,2026-03-04T08:00:00Z,raw/R3.npy,,,5000.5,19.0\n";
  campaign.write(folder / "source");
  const ProgramResult imported = run("import source --db c.db");
  EXPECT_EQ(imported.code, 0);
  EXPECT_EQ(imported.error,
            "warning: runs.csv:4, column air_temperature_C: session S2 has 68.5, all others 19 to 20.7; from "
            "degF these would be 20.3: another unit?\n"
            "warning: runs.csv:5: run R4 has the array of run R3, raw/R3.npy: was the row copied?\n");
}

TEST_F(UnitMistakes, ABlockOfATableInAnotherUnit) {
  write_text(folder / "t.csv", "day,N,CT\n1,5000,0.1\n2,5010,0.1\n3,83.4,0.1\n4,4990,0.1\n");
  write_text(folder / "t.toml",
             "format = \"tunnelrig-table/1\"\nblocks = \"day\"\n[response]\ncolumn = \"CT\"\n"
             "meaning = \"c_t\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n");
  const ProgramResult imported = run("import t.csv --format table --schema t.toml --db t.db");
  EXPECT_EQ(imported.code, 0);
  EXPECT_EQ(imported.error,
            "warning: t.csv:4, column N: day 3 has 83.4, all others 4990 to 5010; from rev/s these would be "
            "5004: another unit?\n");
  EXPECT_THAT(imported.out, HasSubstr("t.db: 4 observations"));
}

}  // namespace
}  // namespace tunnelrig
