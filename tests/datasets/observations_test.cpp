#include "datasets/observations.h"

#include "datasets/rcbenchmark.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

struct TableFiles : testing::Test {
  test::TemporaryFolder folder;
};

const char* const kSchema = R"TOML(format = "tunnelrig-table/1"
name = "bench"
groups = ["prop", "motor"]
blocks = "bins(N, 4)"
hold_out = "N > 5000"

[response]
column = "T"
unit = "gf"
meaning = "thrust_N"

[speed]
column = "N"
unit = "rpm"
electrical = true
pole_count = 14

[propeller]
diameter_column = "D"
diameter_unit = "in"

[[covariates]]
column = "Tair"
unit = "K"
meaning = "air_temperature_C"
)TOML";

const char* const kTable = "prop,motor,T,N,D,Tair\nA,m,1000,35000,10,293.15\nB,m,500,28000,5,300.15\n";

std::string refusal(std::string schema, const std::string& from, const std::string& to,
                    const std::string& table = kTable) {
  schema.replace(schema.find(from), from.size(), to);
  return message_of(
      [&] { read_observations(parse_csv(table, "t.csv"), parse_table_schema(schema, "s.toml")); });
}

TEST(Observations, ConvertsToSi) {
  const auto table = read_observations(parse_csv(kTable, "t.csv"), parse_table_schema(kSchema, "s.toml"));
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0].group, "A / m");
  EXPECT_NEAR(table.rows[0].response, 9.80665, 1e-12);
  EXPECT_NEAR(table.rows[0].speed_rpm.value(), 5000, 1e-9);  // 14 poles: 7 electrical revolutions to one
  EXPECT_NEAR(table.rows[0].diameter_m.value(), 0.254, 1e-12);
  EXPECT_NEAR(table.rows[1].air_temperature_C, 27, 1e-9);
  EXPECT_EQ(table.schema.hold_out, "N > 5000");
}

TEST_F(TableFiles, DatesAreDaysSinceTheEarliest) {
  const std::string schema =
      "format = \"tunnelrig-table/1\"\n[response]\ncolumn = \"F\"\nunit = \"N\"\n"
      "[[covariates]]\ncolumn = \"when\"\nunit = \"date\"\n";
  write_text(folder / "s.toml", schema);
  write_text(folder / "t.csv",
             "when,F\n2026-03-02T12:00:00Z,1\n2026-03-01,2\n,3\n2026-03-01 18:00:00+02:00,4\n");
  const ObservationTable table = read_table(folder / "t.csv", folder / "s.toml");
  EXPECT_EQ(table.sheet.number(0, "when"), 1.5);
  EXPECT_EQ(table.sheet.number(1, "when"), 0);
  EXPECT_EQ(table.sheet.number(2, "when"), std::nullopt);
  EXPECT_NEAR(table.sheet.number(3, "when").value(), 16. / 24, 1e-9);
  EXPECT_EQ(table.schema.covariates[0].kept_unit(), "days");
  store_table(table, folder / "t.db", false);
  const ObservationTable stored = observations_of(CampaignFile(folder / "t.db", CampaignFile::Access::kRead));
  EXPECT_EQ(stored.sheet.number(0, "when"), 1.5);
  write_text(folder / "t.csv", "when,F\n2026-03-02,1\n2.3.2026,2\n");
  EXPECT_THAT(message_of([&] { read_table(folder / "t.csv", folder / "s.toml"); }),
              AllOf(HasSubstr("t.csv:3"), HasSubstr("'2.3.2026' is no date")));
  EXPECT_THAT(message_of([&] {
                parse_table_schema(
                    "format = \"tunnelrig-table/1\"\n[response]\ncolumn = \"F\"\nunit = \"date\"\n",
                    "s.toml");
              }),
              HasSubstr("a response is a number"));
}

TEST(Observations, NamesWhatIsWrong) {
  EXPECT_THAT(refusal(kSchema, "unit = \"gf\"", "unit = \"slug\""),
              HasSubstr("s.toml:7: T: 'slug' is not a known unit"));
  EXPECT_THAT(refusal(kSchema, "unit = \"gf\"\nmeaning = \"thrust_N\"", "unit = \"text\""),
              HasSubstr("s.toml:9: response.unit is \"text\""));
  EXPECT_THAT(refusal(kSchema, "unit = \"gf\"", "unit = \"V\""),
              HasSubstr("thrust_N is a force, and 'V' is a unit of voltage"));
  EXPECT_THAT(refusal(kSchema, "column = \"T\"", "column = \"thrust\""),
              HasSubstr("t.csv:1: the required column thrust is missing"));
  EXPECT_THAT(refusal(kSchema, "pole_count = 14\n", ""), HasSubstr("speed.pole_count is required"));
  EXPECT_THAT(refusal(kSchema, "pole_count = 14\n", "pole_count = 7\n"), HasSubstr("even number"));
  for (const char* flag : {"electrical = false\n", "# electrical\n"})
    EXPECT_THAT(refusal(kSchema, "electrical = true\n", flag),
                HasSubstr("s.toml:16: speed.pole_count is of electrical speeds: write electrical = true"));
  EXPECT_THAT(refusal(kSchema, "diameter_column = \"D\"\n", "diameter_column = \"D\"\ndiameter_m = 0.2\n"),
              HasSubstr("write one of them"));
  EXPECT_THAT(refusal(kSchema, "diameter_unit = \"in\"", "diameter_unit = \"inch\""),
              HasSubstr("s.toml:20: propeller.diameter_unit: 'inch' is not a known unit"));
  for (const char* diameter : {"-10", "0"})
    EXPECT_THAT(refusal(kSchema, "name", "name",
                        fmt::format("prop,motor,T,N,D,Tair\nA,m,1,35000,{},293\n", diameter)),
                HasSubstr("is no diameter of a propeller"));
  EXPECT_THAT(refusal(kSchema, "bins(N, 4)", "bins(N)"), HasSubstr("blocks = \"bins(N)\""));
  EXPECT_THAT(refusal(kSchema, "bins(N, 4)", "day"), HasSubstr("the required column day is missing"));
  EXPECT_THAT(refusal(kSchema, "\"air_temperature_C\"", "\"warmth\""),
              HasSubstr("'warmth' is no known meaning"));
  EXPECT_THAT(refusal(kSchema, "name", "name", "prop,motor,T,N,D,Tair\nA,m,,35000,10,293.15\n"),
              HasSubstr("t.csv:2: column T: the response must not be empty"));
  EXPECT_THAT(refusal(kSchema, "name", "name", "prop,motor,T,N,D,Tair\nA,m,1,35000,10,-3\n"),
              HasSubstr("-3 K is below absolute zero"));
  EXPECT_THAT(refusal(kSchema, "name", "name", "prop,motor,T,N,D,Tair\nA,m,nan,35000,10,3\n"),
              HasSubstr("t.csv:2: column T: 'nan'"));
  EXPECT_THAT(refusal(kSchema, "name", "name", "prop,motor,T,N,D,Tair\n"), HasSubstr("holds no row"));
}

TEST(Observations, StoredAndReadBack) {
  const test::TemporaryFolder folder;
  write_text(folder / "t.csv", kTable);
  write_text(folder / "s.toml", kSchema);
  const ObservationTable read = read_table(folder / "t.csv", folder / "s.toml");
  EXPECT_EQ(read.rows.size(), 2u);
  store_table(read, folder / "c.db", false);
  EXPECT_THAT(message_of([&] { store_table(read, folder / "c.db", false); }), HasSubstr("already holds"));
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  EXPECT_EQ(observations_of(file).rows.size(), 2u);
  EXPECT_THAT(message_of([&] { (void)file.info(); }),
              HasSubstr("holds a table of observations, no campaign of runs"));
}

TEST(Rcbenchmark, TakesSpeedFromTheProbeThatWasThere) {
  const test::TemporaryFolder folder;
  write_text(folder / "s.csv",
             "Time (s),ESC signal (µs),Thrust (gf),Voltage (V),Motor Electrical Speed (RPM),Motor Optical "
             "Speed (RPM)\n"
             "0,1000,10,11,3000,0\n1,1200,40,11,6000,0\n");
  const auto table = read_rcbenchmark(folder / "s.csv", {.propeller_diameter_m = 0.127});
  EXPECT_EQ(table.rows[1].speed_rpm, 6000);
  EXPECT_EQ(table.rows[1].diameter_m, 0.127);
  EXPECT_EQ(table.rows[1].group, "s.csv");
  EXPECT_NEAR(table.rows[1].response, 0.04 * 9.80665, 1e-12);
}

TEST(Rcbenchmark, NamesOfFilesAndColumnsAreAnyText) {
  const test::TemporaryFolder folder;
  for (const char* name : {"5\" x 3\".csv", "a\\x.csv", "tab\t.csv"}) {
    write_text(folder / name, "Thrust (N),\"Voltage \"\"main\"\" (V)\"\n1,11\n2,12\n");
    const auto table = read_rcbenchmark(folder / name, {});
    EXPECT_EQ(table.schema.name, name);
    ASSERT_EQ(table.schema.covariates.size(), 1u);
    EXPECT_EQ(table.schema.covariates[0].column, "Voltage \"main\" (V)");
  }
}

TEST(Rcbenchmark, AFileNamedInCapitalsIsASweepToo) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  for (const char* name : {"in/a.csv", "in/B.CSV"}) write_text(folder / name, "Thrust (N)\n1\n2\n");
  EXPECT_EQ(read_rcbenchmark(folder / "in", {}).rows.size(), 4u);
}

TEST(Rcbenchmark, EachFileHasTheSpeedOfItsOwnProbe) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  const std::string header = "Thrust (gf),Motor Electrical Speed (RPM),Motor Optical Speed (RPM)\n";
  write_text(folder / "in/a.csv", header + "10,0,3000\n40,0,6000\n");
  write_text(folder / "in/b.csv", header + "10,3100,0\n40,6100,0\n");
  write_text(folder / "in/c.csv", "Thrust (gf)\n10\n");
  const auto table = read_rcbenchmark(folder / "in", {});
  ASSERT_EQ(table.rows.size(), 5u);
  EXPECT_EQ(table.schema.speed_column, "Motor Speed (RPM)");
  EXPECT_EQ(table.rows[1].speed_rpm, 6000);
  EXPECT_EQ(table.rows[3].speed_rpm, 6100);
  EXPECT_FALSE(table.rows[4].speed_rpm);
  EXPECT_THAT(
      message_of([&] { read_rcbenchmark(folder / "in", {.pole_count = 14}); }),
      HasSubstr("b.csv:1: --pole-count: its speed is Motor Electrical Speed (RPM), that of a.csv is"));
  write_text(folder / "in/b.csv", "Thrust (gf),Motor Electrical Speed (rad/s)\n10,310\n");
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "in", {}); }),
              HasSubstr("b.csv:1: its speed is Motor Electrical Speed (rad/s), that of a.csv is"));
}

TEST(Rcbenchmark, AFileWithoutTheThrustOfTheOthersIsNamed) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  write_text(folder / "in/a.csv", "Thrust (gf),Motor Optical Speed (RPM)\n10,3000\n");
  write_text(folder / "in/c.csv", "Thrust (lbf),Motor Optical Speed (RPM)\n10,3000\n");
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "in", {}); }),
              testing::StrEq("c.csv:1: no column Thrust (gf), which other files of the folder have; Thrust "
                             "(lbf) is in another unit or by another name"));
  write_text(folder / "in/c.csv", "Motor Optical Speed (RPM)\n3000\n");
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "in", {}); }),
              testing::StrEq("c.csv:1: no column Thrust (gf), which other files of the folder have"));
}

/// The program's own logs have a row for every reading of any sensor, and a thrust in few of them.
TEST(Rcbenchmark, RowsWithoutAThrustAreLeftOutAndCounted) {
  const test::TemporaryFolder folder;
  const std::string header = "Time (s),Thrust (gf),Motor Optical Speed (RPM)\n";
  std::filesystem::create_directory(folder / "in");
  write_text(folder / "in/a.csv", header + "0,,0\n1,10,3000\n2,,4000\n3,40,6000\n");
  write_text(folder / "in/b.csv", header + "0,10,3000\n");
  const auto table = read_rcbenchmark(folder / "in", {});
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.without_response, 2u);
  EXPECT_EQ(table.rows[1].place, "a.csv:5");
  EXPECT_EQ(table.rows[1].speed_rpm, 6000);
  write_text(folder / "in/b.csv", header + "0,,3000\n1,,3000\n");
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "in", {}); }),
              testing::StrEq("b.csv: no row has a value of Thrust (gf), which is the response"));
}

TEST(Rcbenchmark, MessagesMayHoldCommas) {
  const test::TemporaryFolder folder;
  write_text(folder / "s.csv",
             "Thrust (N),Motor Optical Speed (RPM),App message,\n1,3000,,\n2,4000,\"Cutoff, by you\",\n"
             "3,5000,Burst current, 12 A, 3 s,\n");
  const auto table = read_rcbenchmark(folder / "s.csv", {});
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.sheet.text(1, "App message"), "Cutoff, by you");
  EXPECT_EQ(table.sheet.text(2, "App message"), "Burst current, 12 A, 3 s");
  write_text(folder / "s.csv", "Thrust (N),Motor Optical Speed (RPM),App message,\n1,3000\n");
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "s.csv", {}); }), HasSubstr("s.csv:2: 2 cells"));
}

TEST(Rcbenchmark, SweepsTableNamesGroups) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  for (const char* name : {"a.csv", "b.csv"}) {
    write_text(folder / "in" / name, "Thrust (N),Motor Optical Speed (RPM)\n1,3000\n");
  }
  write_text(folder / "sweeps.csv", "file,group,propeller_diameter_m\na.csv,G,0.1\nb.csv,G,0.2\n");
  store_table(read_rcbenchmark(folder / "in", {.sweeps_csv = folder / "sweeps.csv"}), folder / "c.db", false);
  const auto table = observations_of(CampaignFile(folder / "c.db", CampaignFile::Access::kRead));
  EXPECT_EQ(table.rows[0].group, "G");
  EXPECT_EQ(table.rows[1].diameter_m, 0.2);
  write_text(folder / "short.csv", "file,group\na.csv,G\n");
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "in", {.sweeps_csv = folder / "short.csv"}); }),
              HasSubstr("has no row for b.csv"));
}

TEST(Rcbenchmark, RowsOfAFolderAreNamedByTheirOwnFileAndLine) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  const std::string header = "Thrust (N),Motor Optical Speed (RPM)\n";
  write_text(folder / "in/a.csv", header + "1,3000\n2,4000\n");
  write_text(folder / "in/b.csv", header + "1,3000\n\n2,4000\n");
  store_table(read_rcbenchmark(folder / "in", {}), folder / "c.db", false);
  const auto table = observations_of(CampaignFile(folder / "c.db", CampaignFile::Access::kRead));
  ASSERT_EQ(table.rows.size(), 4u);
  EXPECT_EQ(table.rows[1].place, "a.csv:3");
  EXPECT_EQ(table.rows[3].place, "b.csv:4");
  write_text(folder / "in/b.csv", header + "1,3000\nmuch,4000\n");
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "in", {}); }),
              HasSubstr("b.csv:3: column Thrust (N): 'much' is not a finite decimal number"));
}

TEST(Rcbenchmark, SweepsWithoutATachometerAreThrustAlone) {
  const test::TemporaryFolder folder;
  write_text(folder / "s.csv",
             "ESC signal (µs),Thrust (gf),Motor Optical Speed (RPM)\n1200,10,0\n1400,40,0\n");
  const auto table = read_rcbenchmark(folder / "s.csv", {});
  EXPECT_FALSE(table.schema.speed_column);
  EXPECT_FALSE(table.rows[1].speed_rpm);
  EXPECT_NEAR(table.rows[1].response, 0.04 * 9.80665, 1e-12);
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "s.csv", {.pole_count = 14}); }),
              HasSubstr("--pole-count: no column Motor Optical Speed or Motor Electrical Speed has a value"));
}

TEST(Rcbenchmark, OptionsAreRefusedByTheirNames) {
  EXPECT_THAT(
      message_of([] { read_rcbenchmark("any", {.propeller_diameter_m = 127}); }),
      HasSubstr("--propeller-diameter-m 127: must be from 0.01 to 10, in metres; is it in millimetres?"));
  EXPECT_THAT(message_of([] { read_rcbenchmark("any", {.pole_count = 7}); }),
              HasSubstr("--pole-count 7: must be an even number"));
}

TEST(Rcbenchmark, SemicolonsAreNamed) {
  const test::TemporaryFolder folder;
  write_text(folder / "s.csv", "Thrust (N);Voltage (V);Current (A)\n1;12;3\n");
  EXPECT_THAT(message_of([&] { read_rcbenchmark(folder / "s.csv", {}); }),
              HasSubstr("separated by semicolons"));
}

TEST(Rcbenchmark, StrawsonMotors) {
  SKIP_WITHOUT_SHARED_DATA();
  const auto table =
      read_rcbenchmark(test::shared_data() / "strawson_motors/rawdata", {.propeller_diameter_m = 0.127});
  EXPECT_GT(table.rows.size(), 2000u);
}

}  // namespace
}  // namespace tunnelrig
