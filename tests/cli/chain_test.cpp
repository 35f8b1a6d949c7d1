// From bytes to a map with the program itself.
#include "cli/program.h"
#include "datasets/campaign_file.h"
#include "datasets/csv.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <fstream>
#include <future>
#include <map>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;
using test::ProgramResult;
using testing::HasSubstr;
using testing::Not;

struct Chain : testing::Test {
  test::TemporaryFolder folder;

  ProgramResult run(const std::string& arguments) const {
    return test::run_program(folder.path(), arguments);
  }

  void expect_well(const std::string& arguments) const {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.code, 0) << arguments << "\n" << result.error << result.out;
  }
};

TEST_F(Chain, PlanResumesWhereItStopped) {
  expect_well("plan --out plan.csv --tunnel-only --repeats 2 --duration 1");
  const Sheet plan = read_csv(folder / "plan.csv");
  std::string half;
  Sheet first = plan;
  first.rows.resize(plan.rows.size() / 2);
  write_text(folder / "half.csv", format_csv(first));
  expect_well("log --db c.db --plan half.csv --speed max");
  const ProgramResult rest = run("log --db c.db --plan plan.csv --speed max");
  EXPECT_EQ(rest.code, 0);
  EXPECT_THAT(rest.out, HasSubstr(std::to_string(plan.rows.size() - first.rows.size()) + " of " +
                                  std::to_string(plan.rows.size()) + " runs to record"));
  expect_well("log --db whole.db --plan plan.csv --speed max");
  expect_well("export --db c.db one");
  expect_well("export --db whole.db other");
  EXPECT_EQ(read_text(folder / "one/runs.csv"), read_text(folder / "other/runs.csv"))
      << "the virtual rig does not depend on the break";
  EXPECT_THAT(run("log --db c.db --plan plan.csv --speed max").out, HasSubstr("0 of "));
}

/// Longer ones than the virtual calendar's five minutes, in one go and after a break.
TEST_F(Chain, LongRunsOfTheVirtualRigDoNotOverlap) {
  write_text(folder / "plan.csv",
             "session,location,repeat,duration_s\nS1,OT,1,400\nS1,OT,2,1\nS1,OT,3,1\nS2,OT,4,1\n");
  expect_well("log --db c.db --plan plan.csv --speed max");
  expect_well("log --db c.db --location OT --repeat 5 --session S1 --duration 1 --speed max");
  std::vector<double> starts_s;
  for (const auto& run : CampaignFile(folder / "c.db", CampaignFile::Access::kRead).runs())
    starts_s.push_back(run.start_s - 1772409600 - 8 * 3600);
  EXPECT_THAT(starts_s, testing::ElementsAre(0, 460, 760, 86400, 1060));
}

/// An import brings names of its own, and raw files of its own.
TEST_F(Chain, ALoggedRunHasANameThatNoImportedOneHas) {
  test::ExampleCampaign campaign;
  campaign.runs_csv =
      "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N,air_temperature_"
      "C\n"
      "R0003,OT,1,S1,2026-03-02T08:00:00Z,,7.1,7.2,7.3,7.4,20\n"
      "mine,OT,2,S1,2026-03-02T08:05:00Z,raw/R0004.npy,,,,,20\n";
  campaign.write(folder / "source");
  fs::rename(folder / "source/raw/R1.npy", folder / "source/raw/R0004.npy");
  expect_well("import source --db c.db");
  expect_well("log --db c.db --location OT --repeat 3 --session S1 --duration 1 --speed max");
  expect_well("log --db c.db --location OT --repeat 4 --session S1 --duration 1 --speed max");
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  const auto runs = file.runs();
  ASSERT_EQ(runs.size(), 4u);
  EXPECT_EQ(runs[2].run, "R0005");
  EXPECT_EQ(runs[3].run, "R0006");
}

/// The bytes of all runs of a plan, one after the other.
TEST_F(Chain, ACaptureHoldsEveryRunOfAPlan) {
  write_text(folder / "plan.csv", "session,location,repeat,duration_s\nS1,OT,1,2\nS1,OT,2,2\n");
  expect_well("log --db c.db --plan plan.csv --speed max --capture both");
  expect_well("log --db d.db --location OT --session S1 --duration 2 --speed max --capture one");
  EXPECT_GE(fs::file_size(folder / "both"), 2 * 2666 * 10u);  // frames of 8 bytes and a status
  EXPECT_LT(fs::file_size(folder / "one"), fs::file_size(folder / "both"));
  const ProgramResult full =
      run("log --db c.db --location OT --repeat 3 --session S1 --duration 1 --speed max --capture /dev/full");
  EXPECT_EQ(full.code, 1);
  EXPECT_THAT(full.error, HasSubstr("/dev/full: cannot be written any more"));
  EXPECT_THAT(full.out, HasSubstr("R0003  S1 OT #3"));
}

TEST_F(Chain, ACaptureIsNotWrittenOver) {
  write_text(folder / "bytes", "of an earlier call");
  const ProgramResult result =
      run("log --db c.db --location OT --session S1 --duration 1 --speed max --capture bytes");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, HasSubstr("--capture bytes: exists and is not empty"));
  EXPECT_EQ(read_text(folder / "bytes"), "of an earlier call");
  EXPECT_FALSE(fs::exists(folder / "c.db"));
}

TEST_F(Chain, APlansOwnColumnsAreStoredWithItsRuns) {
  write_text(
      folder / "plan.csv",
      "session,location,repeat,duration_s,grille,air_pressure_Pa,cable_mm,tip_cm_s\nS1,OT,1,1,open,1,3,4\n");
  const ProgramResult result = run("log --db c.db --plan plan.csv --speed max");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.error, HasSubstr("not stored: air_pressure_Pa"));
  const auto runs = CampaignFile(folder / "c.db", CampaignFile::Access::kRead).runs();
  EXPECT_EQ(runs.at(0).labels.at("grille"), "open");
  EXPECT_GT(runs.at(0).number("air_pressure_Pa"), 9e4);
  const ProgramResult exported = run("export --db c.db --format csv --parts models typed");
  EXPECT_EQ(exported.code, 1) << "asked for by name";
  EXPECT_THAT(exported.out, HasSubstr("without models: no effect has been adopted yet"));
  const std::string columns = read_text(folder / "typed/columns.csv");
  EXPECT_THAT(columns, HasSubstr("runs,cable_mm,mm,"));
  EXPECT_THAT(columns, HasSubstr("runs,tip_cm_s,cm/s,"));
}

TEST_F(Chain, ARunThatIsThereAlreadyIsSaid) {
  const std::string log = "log --db c.db --location OT --session S1 --duration 1 --speed max";
  EXPECT_THAT(run(log).error, Not(HasSubstr("already")));
  const ProgramResult again = run(log);
  EXPECT_EQ(again.code, 0);
  EXPECT_THAT(again.error, HasSubstr("holds a complete thrust run of session S1 at OT, repeat 1, already"));
}

/// It reads what it was given before it takes the file's write lock: a recorder would wait for it.
TEST_F(Chain, ACalibrationThatReadsHoldsNobodyUp) {
  const test::ExampleCampaign campaign;
  campaign.write(folder / "source");
  expect_well("import source --db c.db");
  ASSERT_EQ(::mkfifo((folder / "points.csv").c_str(), 0600), 0);
  auto calibrated =
      std::async(std::launch::async, [&] { return run("calibrate --db c.db --points points.csv"); });
  std::ofstream points(folder / "points.csv");  // opens once the program reads it
  {
    CampaignFile other(folder / "c.db", CampaignFile::Access::kWrite);
    EXPECT_TRUE(other.atomically_if_free([] {}));
  }
  points << campaign.calibration_csv;
  points.close();
  EXPECT_EQ(calibrated.get().code, 0);
}

TEST_F(Chain, LossesAreSaidAndExitWithOne) {
  const ProgramResult lossy = run(
      "log --db c.db --location OT --session S1 --duration 20 --speed max --faults drop=0.02,reboot=5:0.5");
  EXPECT_EQ(lossy.code, 1);
  EXPECT_THAT(lossy.error, HasSubstr("frames lost"));
  EXPECT_THAT(lossy.error, HasSubstr("1 reboots"));
  expect_well("calibrate --db c.db");
  const ProgramResult doctor = run("doctor --db c.db");
  EXPECT_EQ(doctor.code, 1);
  EXPECT_THAT(doctor.out, HasSubstr("more than 1 % of the frames lost in R0001"));
  EXPECT_THAT(doctor.out, HasSubstr("while recording: R0001 (loss)"));
}

TEST_F(Chain, JsonForMachines) {
  expect_well("plan --out plan.csv --tunnel-only --repeats 2 --duration 2");
  expect_well("log --db c.db --plan plan.csv --speed max");
  for (const char* arguments : {"calibrate --db c.db --json", "reduce --db c.db --json",
                                "map --db c.db --out m --json", "doctor --db c.db --json"}) {
    const ProgramResult result = run(arguments);
    EXPECT_TRUE(nlohmann::json::accept(result.out)) << arguments << "\n" << result.out.substr(0, 500);
  }
  const auto reduction = nlohmann::json::parse(run("reduce --db c.db --json").out);
  EXPECT_EQ(reduction["locations"].size(), 42u);
  EXPECT_THAT(reduction["notes"].dump(), testing::Not(HasSubstr("stand in runs.csv")))
      << "thrusts that the certificate made have its uncertainty";
  const double thesis = reduction["locations"][0]["c_t"]["mean"];
  const double propeller = nlohmann::json::parse(
      run("reduce --db c.db --json --convention propeller").out)["locations"][0]["c_t"]["mean"];
  EXPECT_NEAR(propeller / thesis, 3.14159265 * 3.14159265 * 3.14159265 / 32, 1e-6);
}

TEST_F(Chain, AMisspeltLocationDoesNotLeaveTheMapInSilence) {
  test::ExampleCampaign campaign;
  campaign.runs_csv =
      "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N,air_temperature_"
      "C\n";
  for (const char* location : {"OT", "H2V0", "H4V2", "H4V-2", "h4v0", "OS"})
    campaign.runs_csv +=
        fmt::format("{},{},1,S1,2026-03-02T08:00Z,,7.1,7.4,7.2,7.3,20\n", location, location);
  campaign.write(folder / "source");
  expect_well("import source --db c.db");
  const ProgramResult result = run("map --db c.db --out m --json");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.error, HasSubstr("warning: not on the map: h4v0; neither a label"));
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["not_on_the_map"], nlohmann::json::array({"h4v0"}));
  EXPECT_EQ(json["locations"], 4);
}

TEST_F(Chain, MeasuredConditionsEnterOnlyByName) {
  expect_well("plan --out plan.csv --tunnel-only --repeats 2 --duration 2");
  expect_well("log --db c.db --plan plan.csv --speed max");
  expect_well("calibrate --db c.db");
  const auto c_t = [&](const std::string& with) {
    return nlohmann::json::parse(run("reduce --db c.db --json" + with).out)["locations"][3]["c_t"]["std"]
        .get<double>();
  };
  EXPECT_NE(c_t(""), c_t(" --with rotor_speed"));
  EXPECT_EQ(c_t(""), c_t(" --with thesis"));
  EXPECT_EQ(run("reduce --db c.db --with moonlight").code, 2);
}

TEST_F(Chain, HelpOfEveryVerbShowsAnExample) {
  for (const char* verb :
       {"demo", "log", "plan", "import", "export", "calibrate", "reduce", "map", "report", "doctor"}) {
    const ProgramResult help = run(std::string(verb) + " --help");
    EXPECT_EQ(help.code, 0) << verb;
    EXPECT_THAT(help.out, HasSubstr("Example")) << verb;
    EXPECT_THAT(help.out, HasSubstr(std::string("tunnelrig ") + verb)) << verb;
  }
}

}  // namespace
}  // namespace tunnelrig
