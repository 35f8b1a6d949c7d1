// Options that cannot be, or would not be heeded: a message that names them, exit code 2, nothing
// half-written.
#include "cli/refusals.h"
#include "datasets/campaign_file.h"
#include "datasets/csv.h"

#include <filesystem>
#include <fstream>
#include <future>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;
using test::ProgramResult;
using testing::HasSubstr;

struct BadOptions : test::Refusals {};

TEST_F(BadOptions, AndFilesThatAreNotThere) {
  EXPECT_THAT(refusal_of("reduce --db none.db", {}), HasSubstr("none.db: there is no such campaign file"));
  EXPECT_THAT(refusal_of("log --db c.db --location OT", {}),
              HasSubstr("--location and --session are required"));
  EXPECT_THAT(refusal_of("import none --db c.db", {}), HasSubstr("there is no such campaign folder"));
  EXPECT_THAT(refusal_of("import t.csv --format table --db c.db", {}),
              HasSubstr("--schema S.toml is required"));
  EXPECT_THAT(refusal_of("fly --now", {}), testing::Not(testing::IsEmpty()));
  EXPECT_THAT(refusal_of("mapp --db c.db", {}), HasSubstr("mapp: there is no such verb"));
  EXPECT_THAT(refusal_of("", {}), HasSubstr("A subcommand is required"));
  EXPECT_THAT(refusal_of("fly --seed -1", {}), HasSubstr("--seed -1: must not be below 0"));
  EXPECT_THAT(refusal_of("map --db c.db --out m --method foo", {}), HasSubstr("--method: 'foo' is no map"));
  EXPECT_THAT(refusal_of("log --db c.db --plan none.csv", {}), HasSubstr("none.csv: cannot be read"));
}

TEST_F(BadOptions, MoreOfAMapOrAPlanThanThereCanBe) {
  for (const char* nodes : {"100000", "503", "40", "1", "-3"}) {
    EXPECT_THAT(refusal_of(std::string("map --db none.db --out maps --nodes ") + nodes, {}),
                HasSubstr(std::string("--nodes ") + nodes + ": an odd number from 3 to 501"));
  }
  std::ofstream(folder / "l.csv") << "location\nOT\nH4V-2\nH4V-2\n";
  EXPECT_THAT(refusal_of("plan --locations l.csv --out plan.csv", {"l.csv"}),
              HasSubstr("l.csv:4: column location: 'H4V-2' is a location of line 3 already"));
}

TEST_F(BadOptions, OfACalibrationThatWouldIgnoreThem) {
  write_text(folder / "m.csv", "fx,rx\n0,0\n1,2\n2,4.01\n3,6\n");
  const std::string matrix = "calibrate --matrix m.csv --forces fx --readings rx ";
  for (const char* option : {"--points m.csv", "--propellers m.csv", "--loss huber", "--db c.db"})
    EXPECT_THAT(refusal_of(matrix + option, {"m.csv"}), HasSubstr("--matrix excludes --")) << option;
  for (const char* option :
       {"--forces fx", "--readings rx", "--force-unit gf", "--zeros common", "--diagonal"})
    EXPECT_THAT(refusal_of(std::string("calibrate --db c.db ") + option, {"m.csv"}),
                HasSubstr("requires --matrix"))
        << option;
  EXPECT_NE(test::run_program(folder.path(), matrix).code, 2);
}

/// A row that no verb could read again would lock the whole file.
TEST_F(BadOptions, ConditionsThatNoSheetCanHold) {
  const auto refused = [&](const std::string& option) {
    return refusal_of("log --db c.db --location OT --session S1 --duration 1 --speed max " + option, {});
  };
  EXPECT_THAT(refused("--humidity 45"),
              HasSubstr("--humidity: 45 is outside 0 to 1; a fraction from 0 to 1"));
  EXPECT_THAT(refused("--temperature-C 294"), HasSubstr("--temperature-C: 294 is outside -80 to 80"));
  EXPECT_THAT(refused("--temperature-C nan"), HasSubstr("--temperature-C nan: a number is required"));
  EXPECT_THAT(refused("--pressure-Pa 1013"), HasSubstr("pascal, not hectopascal"));
  EXPECT_THAT(refused("--supply-V -1"), HasSubstr("--supply-V: -1"));
  EXPECT_THAT(refused("--speed-rpm -5"), HasSubstr("--speed-rpm: -5"));
  EXPECT_THAT(refused("--motor-s -3"), HasSubstr("--motor-s: -3"));
  EXPECT_THAT(refused("--repeat -1"), HasSubstr("--repeat: -1"));
  const std::string surrogate = "\"$(printf '\\355\\240\\200')\"";
  EXPECT_THAT(refusal_of("log --db c.db --location OT --session " + surrogate, {}),
              HasSubstr("--session: this is not UTF-8"));
  EXPECT_THAT(refusal_of("log --db c.db --session S1 --location " + surrogate, {}),
              HasSubstr("--location: this is not UTF-8"));
}

/// A run at another place than was asked for would be found out much later.
TEST_F(BadOptions, APlanAndARun) {
  write_text(folder / "plan.csv", "session,location,repeat\nS1,OT,1\n");
  const std::string log = "log --db c.db --plan plan.csv --speed max ";
  for (const char* option : {"--location H4V0", "--session S2", "--kind tare", "--repeat 3", "--duration 5"})
    EXPECT_THAT(refusal_of(log + option, {"plan.csv"}), HasSubstr("is for one run; --plan says it"));
  for (const char* option : {"--kind tare", "--repeat 3"}) {
    EXPECT_THAT(refusal_of(log + "--live 0 " + option, {"plan.csv"}),
                HasSubstr("is for one run; --plan says it"));
    EXPECT_THAT(refusal_of(std::string("log --db c.db --speed max --live 0 ") + option, {"plan.csv"}),
                HasSubstr("is of the run at --location"));
  }
}

/// The frames of such a run have no number that holds them.
TEST_F(BadOptions, DurationsOfNoRun) {
  for (const char* duration : {"0", "2e5", "1e300", "inf"})
    EXPECT_THAT(
        refusal_of(
            fmt::format("log --db c.db --location OT --session S1 --speed max --duration {}", duration), {}),
        HasSubstr("seconds, above 0, at most 100000"));
}

TEST_F(BadOptions, ALogThatFailsLeavesNoFile) {
  const std::string log = "log --db c.db --session S1 --duration 1 ";
  EXPECT_THAT(refusal_of(log + "--location OT --source tcp:localhost:1", {}), HasSubstr("cannot be opened"));
  EXPECT_THAT(refusal_of(log + "--location Q9 --speed max", {}),
              HasSubstr("does not know the location 'Q9'"));
  EXPECT_THAT(refusal_of(log + "--location OT --campaign none.toml", {}), HasSubstr("none.toml"));
  EXPECT_THAT(refusal_of(log + "--location OT --speed max --capture none/bytes", {}),
              HasSubstr("none/bytes: cannot be written: No such"));
  EXPECT_THAT(refusal_of(log + "--location OT --speed max --capture c.db", {}),
              HasSubstr("c.db: cannot be written: it is a campaign file"));
}

/// The file is made between this call's start and its refusal: it is not this call's to take away.
TEST_F(BadOptions, ALogThatFailsLeavesTheFileOfAnotherRecorder) {
  ASSERT_EQ(::mkfifo((folder / "plan.csv").c_str(), 0600), 0);
  auto refused = std::async(std::launch::async, [&] {
    return test::run_program(folder.path(), "log --db c.db --plan plan.csv --yes --speed max");
  });
  std::ofstream plan(folder / "plan.csv");  // opens once the program reads it
  CampaignFile other(folder / "c.db", CampaignFile::Access::kRecord);
  other.set_text("campaign.toml", reference_campaign_toml());
  plan << "session,location,repeat\nS1,OT,1\n";
  plan.close();
  const ProgramResult result = refused.get();
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, HasSubstr("is being recorded to by process"));
  EXPECT_TRUE(fs::exists(folder / "c.db"));
  EXPECT_TRUE(fs::exists(folder / "c.db.lock"));
}

/// What is asked for and would not be done is refused, not left out in silence.
TEST_F(BadOptions, ThatTheFileCannotServe) {
  write_text(folder / "t.csv", "N,y\n3000,0.1\n4000,0.11\n");
  write_text(folder / "t.toml",
             "format = \"tunnelrig-table/1\"\n[response]\ncolumn = \"y\"\nunit = \"1\"\n"
             "meaning = \"c_t_propeller\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n");
  ASSERT_EQ(test::run_program(folder.path(), "import t.csv --format table --schema t.toml --db t.db").code,
            0);
  const std::vector<std::string> files = {"t.csv", "t.toml", "t.db"};
  for (const char* option : {"--runs-csv r.csv", "--from-raw", "--with rotor_speed"})
    EXPECT_THAT(refusal_of(std::string("reduce --db t.db --csv o.csv ") + option, files),
                HasSubstr("a table"))
        << option;
  fs::remove(folder / "t.db");
  campaign.write(folder / "source");
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  const std::vector<std::string> of_campaign = {"t.csv", "t.toml", "source", "c.db"};
  EXPECT_THAT(refusal_of("reduce --db c.db --plot p.svg", of_campaign),
              HasSubstr("--plot: draws a table of observations"));
  EXPECT_THAT(refusal_of("reduce --db c.db --no-spectra", of_campaign),
              HasSubstr("--no-spectra: goes with --from-raw"));
  for (const char* option : {"--format png", "--width-mm 100"})
    EXPECT_THAT(refusal_of(std::string("report --db c.db --out r.html ") + option, of_campaign),
                HasSubstr("it goes with --figures"));
}

TEST_F(BadOptions, OfAnotherSource) {
  for (const char* option :
       {"--schema t.toml", "--sweeps s.csv", "--propeller-diameter-m 3", "--pole-count 14"})
    EXPECT_THAT(refusal_of(std::string("import source --db c.db ") + option, {}),
                HasSubstr("is not for --format folder"))
        << option;
  for (const char* option :
       {"--sweeps s.csv", "--propeller-diameter-m 3", "--pole-count 14", "--allow-stuck"})
    EXPECT_THAT(
        refusal_of(std::string("import t.csv --format table --schema t.toml --db c.db ") + option, {}),
        HasSubstr("is not for --format table"))
        << option;
  EXPECT_THAT(refusal_of("import s.csv --format rcbenchmark --allow-stuck --db c.db", {}),
              HasSubstr("is not for --format rcbenchmark"));
  for (const char* option : {"--faults drop=0.5", "--speed 3", "--seed 5"})
    EXPECT_THAT(
        refusal_of(std::string("log --db c.db --location OT --session S1 --source replay:b.bin ") + option,
                   {}),
        HasSubstr("is for the virtual rig"))
        << option;
}

}  // namespace
}  // namespace tunnelrig
