// Bad input: a message that names file, line and rule, exit code 2, nothing half-written.
#include "cli/program.h"
#include "datasets/campaign_file.h"
#include "datasets/csv.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
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

struct BadInput : testing::Test {
  test::TemporaryFolder folder;
  test::ExampleCampaign campaign;

  /// What importing the campaign says; it must be refused and leave nothing behind.
  std::string refusal() {
    fs::remove_all(folder / "source");
    campaign.write(folder / "source");
    return refusal_of("import source --db c.db", {"source"});
  }

  std::string refusal_of(const std::string& arguments, const std::vector<std::string>& files) const {
    const ProgramResult result = test::run_program(folder.path(), arguments);
    EXPECT_EQ(result.code, 2) << arguments << "\n" << result.error;
    EXPECT_EQ(result.out, "") << arguments;
    std::vector<std::string> left;
    for (const auto& entry : fs::directory_iterator(folder.path()))
      left.push_back(entry.path().filename().string());
    EXPECT_THAT(left, testing::UnorderedElementsAreArray(files)) << arguments;
    return result.error;
  }

  static void replace(std::string& text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
};

TEST_F(BadInput, WrongUnit) {
  replace(campaign.runs_csv, "air_temperature_C", "air_temperature_K");
  EXPECT_THAT(refusal(),
              HasSubstr("runs.csv:1: column air_temperature_K: this quantity is read as air_temperature_C"));
  campaign = {};
  replace(campaign.runs_csv, "20.5", "293.65");
  EXPECT_THAT(refusal(), HasSubstr("runs.csv:2: column air_temperature_C: 293.65 is outside"));
}

TEST_F(BadInput, MissingColumn) {
  replace(campaign.calibration_csv, "voltage_V", "reading");
  EXPECT_THAT(refusal(), HasSubstr("calibration.csv:1: the required column voltage_V is missing"));
}

TEST_F(BadInput, NotANumber) {
  replace(campaign.runs_csv, "4999.0", "NaN");
  EXPECT_THAT(refusal(), HasSubstr("runs.csv:3: column speed_rpm: 'NaN' is not a finite decimal number"));
}

TEST_F(BadInput, BelowAbsoluteZero) {
  replace(campaign.runs_csv, "18.0", "-280");
  EXPECT_THAT(refusal(), HasSubstr("below absolute zero"));
}

TEST_F(BadInput, ZeroFramesAndStuckChannel) {
  campaign.write(folder / "source");
  test::write_npy(folder / "source/raw/R3.npy", {}, 0, {});
  EXPECT_THAT(refusal_of("import source --db c.db", {"source"}),
              HasSubstr("runs.csv:4: run R3: raw/R3.npy holds zero frames"));
  auto stuck = test::example_frames(400, 1);
  for (std::size_t i = 0; i < 400; ++i) stuck[i * 8] = stuck[i * 8 + 1] = std::byte{4};
  test::write_npy(folder / "source/raw/R3.npy", {}, 400, stuck);
  EXPECT_THAT(refusal_of("import source --db c.db", {"source"}),
              HasSubstr("channel 1 of raw/R3.npy is stuck"));
}

/// A thrust run like this is refused; what becomes of a tare is said twice.
TEST_F(BadInput, TaresThatAreStuckOrClipped) {
  campaign.runs_csv +=
      "T1,OT,1,S1,2026-03-02T07:50:00Z,raw/T1.npy,0,0,,20\nT2,OT,2,S2,2026-03-03T07:50:00Z,raw/"
      "T2.npy,0,0,,18\n";
  replace(campaign.runs_csv, ",air_temperature_C\n", ",air_temperature_C,kind\n");
  for (const char* row : {",20.5\n", ",20.7\n", ",18.0\n"})
    replace(campaign.runs_csv, row, std::string(row, std::strlen(row) - 1) + ",thrust\n");
  for (const char* row : {",,20\n", ",,18\n"})
    replace(campaign.runs_csv, row, std::string(row, std::strlen(row) - 1) + ",tare\n");
  campaign.write(folder / "source");
  auto stuck = test::example_frames(400, 1), clipped = test::example_frames(400, 2);
  for (std::size_t i = 0; i < 400; ++i) stuck[i * 8 + 2] = stuck[i * 8 + 3] = std::byte{4};
  clipped[0] = std::byte{0xFF};
  clipped[1] = std::byte{0x0F};
  test::write_npy(folder / "source/raw/T1.npy", {}, 400, stuck);
  test::write_npy(folder / "source/raw/T2.npy", {}, 400, clipped);
  const ProgramResult imported = test::run_program(folder.path(), "import source --db c.db");
  EXPECT_EQ(imported.code, 0) << imported.error;
  EXPECT_THAT(imported.error, HasSubstr("runs.csv:5: run T1: channel 2 of raw/T1.npy is stuck at"));
  test::run_program(folder.path(), "calibrate --db c.db");
  const ProgramResult reduced = test::run_program(folder.path(), "reduce --db c.db");
  EXPECT_EQ(reduced.code, 1) << reduced.error;
  EXPECT_THAT(reduced.error, HasSubstr("run T1 is left out: channel 2 is stuck"));
  EXPECT_THAT(reduced.error, HasSubstr("1 runs (1 of them tares) hold clipped samples"));
}

TEST_F(BadInput, AMapOfTwoLocations) {
  campaign.write(folder / "source");
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  EXPECT_THAT(refusal_of("map --db c.db --out maps", {"source", "c.db"}),
              HasSubstr("`tunnelrig calibrate` comes before"));
  ASSERT_NE(test::run_program(folder.path(), "calibrate --db c.db").code, 2);
  EXPECT_THAT(refusal_of("map --db c.db --out maps", {"source", "c.db"}),
              HasSubstr("2 locations make no map; at least 4 are needed"));
}

TEST_F(BadInput, IntoAFileThatHoldsACampaign) {
  campaign.write(folder / "source");
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  EXPECT_THAT(refusal_of("import source --db c.db", {"source", "c.db"}),
              HasSubstr("already holds a campaign"));
  EXPECT_EQ(test::run_program(folder.path(), "import source --db c.db --replace").code, 0);
}

TEST_F(BadInput, OptionsAndFilesThatAreNotThere) {
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

TEST_F(BadInput, MoreOfAMapOrAPlanThanThereCanBe) {
  for (const char* nodes : {"100000", "503", "40", "1", "-3"}) {
    EXPECT_THAT(refusal_of(std::string("map --db none.db --out maps --nodes ") + nodes, {}),
                HasSubstr(std::string("--nodes ") + nodes + ": an odd number from 3 to 501"));
  }
  std::ofstream(folder / "l.csv") << "location\nOT\nH4V-2\nH4V-2\n";
  EXPECT_THAT(refusal_of("plan --locations l.csv --out plan.csv", {"l.csv"}),
              HasSubstr("l.csv:4: column location: 'H4V-2' is a location of line 3 already"));
}

TEST_F(BadInput, AReportOfNothingAndFiguresThatNoPaperHas) {
  EXPECT_THAT(refusal_of("report --db c.db", {}),
              HasSubstr("--out FILE (the page), --figures FOLDER, or both"));
  EXPECT_THAT(refusal_of("report --db c.db --figures f --format eps", {}),
              HasSubstr("eps not in {pdf,svg,png}"));
  EXPECT_THAT(refusal_of("report --db c.db --figures f --width-mm 20", {}),
              HasSubstr("--width-mm: Value 20 not in range 60"));
  campaign.write(folder / "source");
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  write_text(folder / "flights.json", "{}");
  EXPECT_THAT(refusal_of("report --db c.db --out r.html --figures f --flights flights.json",
                         {"source", "c.db", "flights.json"}),
              HasSubstr("flights.json: is no flights.json"));
  EXPECT_THAT(refusal_of("report --db c.db --figures f", {"source", "c.db", "flights.json"}),
              HasSubstr("there is no figure to draw: there is no calibration yet"));
  ASSERT_EQ(test::run_program(folder.path(), "calibrate --db c.db").code, 0);
  write_text(folder / "f", "");
  EXPECT_THAT(refusal_of("report --db c.db --figures f", {"source", "c.db", "flights.json", "f"}),
              HasSubstr("f: figures cannot be written here"));
}

TEST_F(BadInput, ASchemaThatTheTableDoesNotBear) {
  const std::string schema =
      "format = \"tunnelrig-table/1\"\ngroups = [\"g\"]\n[response]\ncolumn = \"y\"\nunit = \"gf\"\n"
      "[[covariates]]\ncolumn = \"h\"\nunit = \"%\"\nmeaning = \"relative_humidity\"\n";
  write_text(folder / "t.csv", "g,y,h\na,10,41\na,11,43\nb,12,44\nb,13,45\n");
  const std::string verb = "import t.csv --format table --schema s.toml --db c.db";
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string text = schema;
    replace(text, from, to);
    write_text(folder / "s.toml", text);
    return refusal_of(verb, {"t.csv", "s.toml"});
  };
  EXPECT_THAT(refused("groups", "group"), HasSubstr("s.toml:2: the file: group is no key here"));
  EXPECT_THAT(refused("\"%\"", "\"1\""), HasSubstr("t.csv:2: column h: 41 is no relative humidity"));
  EXPECT_THAT(refused("groups", "hold_out = \"h >\"\ngroups"), HasSubstr("s.toml:2: hold_out: h > is no"));
  write_text(folder / "s.toml", schema);
  const ProgramResult imported = test::run_program(folder.path(), verb);
  EXPECT_EQ(imported.code, 0) << imported.error;
  EXPECT_EQ(
      imported.out,
      "c.db: 4 observations in 2 groups and 4 blocks; response y [N]; covariates h as relative_humidity\n");
}

TEST_F(BadInput, CalibrationThatSaysNothing) {
  campaign.calibration_csv =
      "cell,applied_force_N,voltage_V\n1,5,1.5\n1,6,1.8\n2,5,1.5\n2,6,1.8\n3,5,1.5\n3,6,1.8\n4,5,1.5\n4,6,1."
      "8\n";
  campaign.write(folder / "source");
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  EXPECT_THAT(refusal_of("calibrate --db c.db", {"source", "c.db"}), HasSubstr("calibration.csv: cell 1"));
  write_text(folder / "mine.csv", campaign.calibration_csv);
  EXPECT_THAT(refusal_of("calibrate --db c.db --points mine.csv", {"source", "c.db", "mine.csv"}),
              HasSubstr("mine.csv: cell 1"));
}

TEST_F(BadInput, CalibrationOptionsThatWouldBeIgnored) {
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

TEST_F(BadInput, CalibrationMessagesNameTheFileThatWasGiven) {
  campaign.write(folder / "source");
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  write_text(folder / "mine.csv", "cell,applied_force_N,voltage_V\n");
  EXPECT_THAT(refusal_of("calibrate --db c.db --points mine.csv", {"source", "c.db", "mine.csv"}),
              HasSubstr("mine.csv: holds no calibration points"));
  std::string grams = "cell,applied_force_N,voltage_V\n";
  for (int cell = 1; cell <= 4; ++cell)
    for (int i = 0; i < 5; ++i)
      grams += fmt::format("{},{},{}\n", cell, 2000 + 500 * i, 1 + 0.1 * i + 0.001 * (i % 2));
  write_text(folder / "mine.csv", grams);
  EXPECT_THAT(test::run_program(folder.path(), "calibrate --db c.db --points mine.csv").out,
              testing::AllOf(HasSubstr("mine.csv:2: column applied_force_N"),
                             testing::Not(HasSubstr("calibration.csv"))));
}

/// Squares of such numbers are not finite: what was computed with them was not a number, or a crash.
TEST_F(BadInput, NumbersThatNothingMeasures) {
  for (const auto& [column, row, value] :
       {std::tuple{"applied_force_N", "1,1e155,1.5\n", "1e+155"}, {"voltage_V", "1,5,1e300\n", "1e+300"}}) {
    campaign = {};
    campaign.calibration_csv = fmt::format("cell,applied_force_N,voltage_V\n{}", row);
    EXPECT_THAT(refusal(),
                HasSubstr(fmt::format("calibration.csv:2: column {}: {} is beyond", column, value)));
  }
  campaign = {};
  campaign.write(folder / "source");
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  write_text(folder / "mine.csv", "cell,applied_force_N,voltage_V\n1,5,1.5\n1,-1e155,1.8\n");
  EXPECT_THAT(refusal_of("calibrate --db c.db --points mine.csv", {"source", "c.db", "mine.csv"}),
              HasSubstr("mine.csv:3: column applied_force_N: -1e+155 is beyond"));
  write_text(folder / "mine.csv", "fx,fy,fz,rx,ry,rz\n");
  EXPECT_THAT(refusal_of("calibrate --matrix mine.csv --forces fx,fy,fz --readings rx,ry,rz",
                         {"source", "c.db", "mine.csv"}),
              HasSubstr("mine.csv: there is no row"));
}

/// A row that no verb could read again would lock the whole file.
TEST_F(BadInput, ConditionsThatNoSheetCanHold) {
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
TEST_F(BadInput, APlanAndARun) {
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
TEST_F(BadInput, DurationsOfNoRun) {
  for (const char* duration : {"0", "2e5", "1e300", "inf"})
    EXPECT_THAT(
        refusal_of(
            fmt::format("log --db c.db --location OT --session S1 --speed max --duration {}", duration), {}),
        HasSubstr("seconds, above 0, at most 100000"));
}

TEST_F(BadInput, ALogThatFailsLeavesNoFile) {
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
TEST_F(BadInput, ALogThatFailsLeavesTheFileOfAnotherRecorder) {
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

TEST_F(BadInput, OutputThatCannotBeWritten) {
  for (const char* arguments : {"explain --list", "explain --list --json -"}) {
    const int status = std::system(  // NOLINT(concurrency-mt-unsafe)
        fmt::format("\"{}\" {} > /dev/full 2> /dev/null", TUNNELRIG_PROGRAM, arguments).c_str());
    EXPECT_EQ(WEXITSTATUS(status), 2) << arguments;
  }
}

/// What is asked for and would not be done is refused, not left out in silence.
TEST_F(BadInput, OptionsThatTheFileCannotServe) {
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

TEST_F(BadInput, OptionsOfAnotherSource) {
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

/// The coefficient stands in the table, the speed was not written down.
TEST_F(BadInput, ASpeedThatIsNotKnownIsNotZero) {
  write_text(folder / "t.csv", "g,N,y\na,3000,0.1\na,,0.2\na,4000,0.11\nb,,0.3\n");
  write_text(folder / "t.toml",
             "format = \"tunnelrig-table/1\"\ngroups = [\"g\"]\n[response]\ncolumn = \"y\"\n"
             "unit = \"1\"\nmeaning = \"c_t_propeller\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n");
  const auto program = [&](const std::string& arguments) {
    return test::run_program(folder.path(), arguments);
  };
  ASSERT_EQ(program("import t.csv --format table --schema t.toml --db t.db").code, 0);
  const ProgramResult reduced = program("reduce --db t.db --csv o.csv --plot o.svg");
  EXPECT_EQ(reduced.code, 0) << reduced.error;
  EXPECT_THAT(reduced.out, testing::ContainsRegex("a +3 +3000 +4000 +0.11000 +0.01483 +0.10000 +0.11000"));
  EXPECT_THAT(reduced.out, testing::ContainsRegex("b +1 +- +- +0.30000 +0.00000 +- +-"));
  EXPECT_THAT(read_text(folder / "o.csv"), HasSubstr("a,t.csv:3,,0.2,propeller\n"));
}

/// gnuplot runs what stands in backquotes, if it stands in double quotes.
TEST_F(BadInput, NamesInATableAreNoCommands) {
  write_text(folder / "t.csv",
             "g,N,y\n`touch ran`,3000,0.1\n`touch ran`,4000,0.11\nb,3000,0.1\nb,3500,0.12\n");
  write_text(
      folder / "t.toml",
      "format = \"tunnelrig-table/1\"\nname = \"`touch ran`\"\ngroups = [\"g\"]\n[response]\ncolumn = \"y\"\n"
      "unit = \"1\"\nmeaning = \"c_t_propeller\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n");
  ASSERT_EQ(test::run_program(folder.path(), "import t.csv --format table --schema t.toml --db t.db").code,
            0);
  write_text(folder / "script", "mine");
  ASSERT_EQ(test::run_program(folder.path(), "reduce --db t.db --plot t.svg").code, 0);
  EXPECT_FALSE(fs::exists(folder / "ran"));
  EXPECT_EQ(read_text(folder / "script"), "mine");
  EXPECT_FALSE(fs::exists(folder / "complaint"));
}

}  // namespace
}  // namespace tunnelrig
