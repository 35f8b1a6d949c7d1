// What a schema asks for that cannot be had is refused, by file, line and key.
#include "analysis/residual/observations/observations.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

const std::string kTop = "format = \"tunnelrig-table/1\"\n";
const std::string kResponse = "[response]\ncolumn = \"y\"\nunit = \"N\"\n";
const std::string kTable = "g,y,x\na,1,0.1\na,2,0.2\nb,3,0.3\nb,4,0.4\n";

ObservationTable read(const std::string& top, const std::string& more = "", const std::string& csv = kTable) {
  return read_observations(parse_csv(csv, "t.csv"),
                           parse_table_schema(kTop + top + kResponse + more, "s.toml"));
}

std::string refusal(const std::string& top, const std::string& more = "", const std::string& csv = kTable) {
  return message_of([&] { check_table(read(top, more, csv)); });
}

std::string covariate(const std::string& column, const std::string& unit, const std::string& meaning) {
  return "[[covariates]]\ncolumn = \"" + column + "\"\nunit = \"" + unit + "\"\n" +
         (meaning.empty() ? "" : "meaning = \"" + meaning + "\"\n");
}

TEST(TableSchema, UnknownKeysAreRefused) {
  EXPECT_THAT(refusal("block = \"g\"\n"),
              HasSubstr("s.toml:2: the file: block is no key here; known are format, name, groups, blocks"));
  EXPECT_THAT(
      refusal("", "meanning = \"thrust_N\"\n"),
      HasSubstr("s.toml:5: response: meanning is no key here; known are column, unit, meaning, scatter"));
  EXPECT_THAT(refusal("", "[[covariate]]\ncolumn = \"x\"\n"),
              HasSubstr("s.toml:5: the file: covariate is no key here"));
  EXPECT_THAT(refusal("", "[[covariates]]\ncolumn = \"x\"\nunits = \"V\"\n"),
              HasSubstr("s.toml:7: covariates: units is no key here"));
  EXPECT_THAT(refusal("", "[air]\npressure_hPa = 1013\n"),
              HasSubstr("s.toml:6: air: pressure_hPa is no key here; known are temperature_C, pressure_Pa"));
  EXPECT_THAT(refusal("", "[speed]\ncolumn = \"x\"\nunit = \"rpm\"\npoles = 14\n"),
              HasSubstr("s.toml:8: speed: poles is no key here"));
  EXPECT_THAT(refusal("", "[propeller]\ndiameter_in = 10\n"),
              HasSubstr("s.toml:6: propeller: diameter_in is no key here"));
}

TEST(TableSchema, ValuesOfTheWrongKindAreRefused) {
  EXPECT_THAT(refusal("", "[covariates]\ncolumn = \"x\"\n"),
              HasSubstr("s.toml:5: covariates: write [[covariates]] for each"));
  EXPECT_THAT(refusal("speed = \"x\"\n"), HasSubstr("s.toml:2: speed must be a table: write [speed]"));
  EXPECT_THAT(refusal("", "[speed]\ncolumn = \"x\"\nunit = \"rpm\"\nelectrical = \"yes\"\n"),
              HasSubstr("s.toml:8: speed.electrical must be true or false"));
  EXPECT_THAT(refusal("hold_out = true\n"), HasSubstr("s.toml:2: hold_out must be text in quotes"));
}

TEST(TableSchema, WhatIsLeftOutHasADefault) {
  const ObservationTable table = read_observations(
      parse_csv(kTable, "t.csv"), parse_table_schema(kTop + "[response]\ncolumn = \"y\"\n", "s.toml"));
  EXPECT_EQ(table.schema.response.unit, "1");
  EXPECT_EQ(table.schema.name, "");
  const TableParts parts = check_table(table);
  EXPECT_EQ(parts.groups, 1);
  EXPECT_EQ(parts.blocks, 4);
}

TEST(TableSchema, OneMeaningIsOneColumns) {
  const std::string csv = "y,x,z\n1,20,21\n2,22,23\n";
  EXPECT_THAT(
      refusal("", covariate("x", "degC", "air_temperature_C") + covariate("z", "K", "air_temperature_C"),
              csv),
      HasSubstr("s.toml:9: z: x is air_temperature_C already; one column can be it"));
  EXPECT_EQ(check_table(read("", covariate("x", "degC", "") + covariate("z", "degC", ""), csv)).groups, 1);
}

TEST(TableSchema, ValuesThatTheirMeaningRulesOutAreRefused) {
  struct Case {
    const char *unit, *meaning, *bad, *good, *reason;
  };
  for (const Case& c :
       {Case{"1", "relative_humidity", "55", "0.55", "55 is no relative humidity, which is from 0 to 1"},
        Case{"%", "relative_humidity", "105.1", "104.9", "105.1 % is no relative humidity"},
        Case{"%", "relative_humidity", "120", "55", "120 % is no relative humidity"},
        Case{"Pa", "air_pressure_Pa", "1013", "101300", "1013 Pa is no absolute pressure of air"},
        Case{"hPa", "air_pressure_Pa", "101", "1013", "101 hPa is no absolute pressure of air"},
        Case{"V", "supply_voltage_V", "-12", "0", "-12 V is no supply voltage"},
        Case{"1", "ground_distance_R", "-1", "0", "-1 is no distance from a wall"},
        Case{"1", "wall_distance_R", "-0.1", "7", "-0.1 is no distance from a wall"},
        Case{"1", "ceiling_distance_R", "-2", "2", "-2 is no distance from a wall"},
        Case{"rpm", "speed_rpm", "-3000", "3000", "-3000 rpm is no rotor speed"},
        Case{"degC", "cell_temperature_C", "290", "40", "290 degC is no temperature of a cell"},
        Case{"degC", "air_temperature_C", "293", "20", "293 degC is no temperature of air"}}) {
    const auto csv = [](const std::string& value) { return fmt::format("y,x\n1,{0}\n2,{0}\n", value); };
    EXPECT_THAT(refusal("", covariate("x", c.unit, c.meaning), csv(c.bad)),
                HasSubstr(std::string("t.csv:2: column x: ") + c.reason));
    EXPECT_EQ(read("", covariate("x", c.unit, c.meaning), csv(c.good)).rows.size(), 2u) << c.meaning;
    EXPECT_EQ(read("", covariate("x", c.unit, ""), csv(c.bad)).rows.size(), 2u) << "without a meaning";
  }
}

/// They can be reduced, but nothing can be found out from them.
TEST(TableSchema, GroupsOfSingleRowsAreNotExplained) {
  const ObservationTable table = read("groups = [\"g\", \"x\"]\n");
  EXPECT_EQ(check_table(table).groups, static_cast<int>(table.rows.size()));
  EXPECT_THAT(message_of([&] { observe_table(table, {}); }),
              HasSubstr("s.toml:2: groups = [\"g\", \"x\"]: every row is a group of its own"));
}

TEST(TableSchema, ScatterIsRelativeOrAbsolute) {
  EXPECT_THAT(refusal("", "scatter = \"abs\"\n"),
              HasSubstr("s.toml:5: scatter = \"abs\"; write \"relative\""));
  EXPECT_TRUE(observe_table(read(""), {}).multiplicative);
  EXPECT_FALSE(observe_table(read("", "scatter = \"absolute\"\n"), {}).multiplicative);
  const std::string volts = kTop + "[response]\ncolumn = \"y\"\nunit = \"mV\"\n";
  const auto of_volts = [&](const std::string& more) {
    return observe_table(
        read_observations(parse_csv(kTable, "t.csv"), parse_table_schema(volts + more, "s.toml")), {});
  };
  EXPECT_FALSE(of_volts("").multiplicative);
  EXPECT_TRUE(of_volts("scatter = \"relative\"\n").multiplicative);
}

TEST(TableSchema, BlocksThatCannotBeHadAreRefused) {
  EXPECT_THAT(
      refusal("blocks = \"bins(g, 3)\"\n"),
      HasSubstr(
          "s.toml:2: blocks = \"bins(g, 3)\": t.csv:2: column g: a number is required here, and 'a' is no"));
  EXPECT_THAT(refusal("blocks = \"bins(x, 2.5)\"\n"),
              HasSubstr("s.toml:2: blocks = \"bins(x, 2.5)\"; write"));
  EXPECT_THAT(refusal("blocks = \"bins(x, 2)\"\n", "", "g,y,x\na,1,0.1\na,2,\n"),
              HasSubstr("t.csv:3: column x: a number is required here"));
  EXPECT_EQ(check_table(read("blocks = \"bins( x , 2)\"\n")).blocks, 2);
}

TEST(TableSchema, AHoldOutThatHoldsNothingOutIsRefused) {
  EXPECT_THAT(refusal("hold_out = \"x >> 1\"\n"), HasSubstr("s.toml:2: hold_out: x >> 1 is no expression"));
  EXPECT_THAT(refusal("hold_out = \"x\"\n"),
              HasSubstr("s.toml:2: hold_out = \"x\": t.csv:2: this is 0.1 here, neither true nor false"));
  EXPECT_THAT(refusal("hold_out = \"x > 9\"\n"), HasSubstr("takes all rows or none"));
  EXPECT_THAT(refusal("hold_out = \"q > 9\"\n"), HasSubstr("the required column q is missing"));
  EXPECT_THAT(refusal("hold_out = \"g == 1\"\n"),
              HasSubstr("s.toml:2: hold_out = \"g == 1\": t.csv:2: column g"));
  EXPECT_EQ(check_table(read("hold_out = \"x > 0.3\"\n")).blocks, 4);
}

TEST(TableSchema, AStoredTableKeepsTheNamesAndLinesOfItsFiles) {
  const test::TemporaryFolder folder;
  write_text(folder / "mine.csv", "y,x\n1,0.1\n\n2,0.2\n3,0.3\n");
  write_text(folder / "mine.toml", kTop + kResponse + covariate("x", "mm", ""));
  store_table(read_table(folder / "mine.csv", folder / "mine.toml"), folder / "c.db", false);
  const ObservationTable table = observations_of(CampaignFile(folder / "c.db", CampaignFile::Access::kRead));
  EXPECT_EQ(table.schema.file, "mine.toml");
  EXPECT_EQ(table.sheet.file, "mine.csv");
  EXPECT_EQ(table.rows[1].place, "mine.csv:4");
}

}  // namespace
}  // namespace tunnelrig
