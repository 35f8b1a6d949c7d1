// Bad input: a message that names file, line and rule, exit code 2, nothing half-written.
#include "cli/refusals.h"
#include "datasets/csv.h"

#include <cstdlib>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;
using test::ProgramResult;
using testing::HasSubstr;

struct BadInput : test::Refusals {
  /// What importing the campaign says; it must be refused and leave nothing behind.
  std::string refusal() {
    fs::remove_all(folder / "source");
    campaign.write(folder / "source");
    return refusal_of("import source --db c.db", {"source"});
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

TEST_F(BadInput, OutputThatCannotBeWritten) {
  for (const char* arguments : {"explain --list", "explain --list --json -"}) {
    const int status = std::system(  // NOLINT(concurrency-mt-unsafe)
        fmt::format("\"{}\" {} > /dev/full 2> /dev/null", TUNNELRIG_PROGRAM, arguments).c_str());
    EXPECT_EQ(WEXITSTATUS(status), 2) << arguments;
  }
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
