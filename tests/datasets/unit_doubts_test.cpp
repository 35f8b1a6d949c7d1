#include "datasets/unit_doubts.h"

#include "datasets/import_doubts.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kToml =
    "format = \"tunnelrig-campaign/1\"\n[rig]\npropeller_radius_m = 0.15\nnominal_speed_rpm = 5000\n";

/// Two runs in each of sessions S1, S2, …, with these cells of these columns, and forces of all rotors.
std::string runs_csv(const std::string& columns, const std::vector<std::string>& cells,
                     const std::vector<std::string>& forces = {}) {
  std::string csv = "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N," +
                    columns + "\n";
  for (std::size_t r = 0; r < cells.size(); ++r)
    csv += fmt::format("R{0},OT,{0},S{1},2026-03-02T08:{0:02}:00Z,,{2},{2},{2},{2},{3}\n", r, r / 2 + 1,
                       forces.empty() ? "7" : forces[r], cells[r]);
  return csv;
}

std::vector<std::string> doubts(const std::string& csv) {
  const CampaignInfo info = parse_campaign_toml(kToml, "campaign.toml");
  const Sheet sheet = parse_csv(csv, "runs.csv");
  return import_doubts(info, sheet, parse_runs(sheet, info));
}

const std::vector<std::string> kFahrenheit = {"19.5", "20", "68", "75", "21", "24", "22", "22"};

TEST(UnitDoubts, ASessionInFahrenheit) {
  EXPECT_THAT(doubts(runs_csv("air_temperature_C", kFahrenheit)),
              ElementsAre("runs.csv:4 to runs.csv:5, column air_temperature_C: session S2 has 68 to 75, all "
                          "others 19.5 to 24; from degF these would be 20 to 23.9: another unit?"));
}

TEST(UnitDoubts, AColumnOfOnesOwnByItsSuffix) {
  const auto unit_of = [](const std::string& column, const std::vector<std::string>& cells) {
    const auto said = doubts(runs_csv(column, cells));
    if (said.size() != 1) return fmt::format("{} doubts", said.size());
    const auto from = said[0].find("from ") + 5;
    return said[0].substr(from, said[0].find(" these") - from);
  };
  EXPECT_EQ(unit_of("motor_temperature_K", {"293", "294", "20.5", "21", "295", "294"}), "°C");
  EXPECT_EQ(unit_of("barometer_Pa", {"101325", "101400", "1013", "1014", "101350", "101500"}), "hPa");
  EXPECT_EQ(unit_of("speed_rpm", {"5000", "5003", "523.6", "523.7", "5001", "4998"}), "rad/s");
  EXPECT_EQ(unit_of("speed_rpm", {"5000", "5003", "83.33", "83.33", "5001", "4998"}), "rev/s");
  EXPECT_EQ(unit_of("bridge_V", {"1.21", "1.22", "1213", "1219", "1.215", "1.22"}), "mV");
  EXPECT_EQ(unit_of("tunnel_airspeed_m_s", {"5.02", "5.05", "18.1", "18.2", "5.01", "5.04"}), "km/h");
  EXPECT_EQ(unit_of("gap_m", {"0.251", "0.252", "250.8", "251.5", "0.251", "0.252"}), "mm");
  EXPECT_EQ(unit_of("gap_m", {"0.251", "0.252", "9.88", "9.9", "0.251", "0.252"}), "in");
  EXPECT_EQ(unit_of("cloud_percent", {"40.1", "42", "0.41", "0.4", "41", "42"}), "fractions");
}

TEST(UnitDoubts, NamesWithoutUnitAndTimesAreNotLookedAt) {
  EXPECT_THAT(doubts(runs_csv("reading", kFahrenheit)), IsEmpty());
  EXPECT_THAT(doubts(runs_csv("time_since_motor_start_s", {"60", "61", "1", "1", "60", "60"})), IsEmpty());
}

TEST(UnitDoubts, WhatIsExcludedIsNotLookedAt) {
  EXPECT_THAT(doubts(runs_csv("air_temperature_C,excluded", {"20,", "20,", "68,°F", "70,°F", "21,", "22,"})),
              IsEmpty());
}

TEST(UnitDoubts, ATareStandsStill) {
  const std::string csv =
      runs_csv("speed_rpm,kind", {"5000,", "5003,", "83.3,tare", "83.3,tare", "5001,", "4998,"});
  const Sheet sheet = parse_csv(csv, "runs.csv");
  EXPECT_THAT(unit_doubts(sheet, parse_runs(sheet, {})).sentences, IsEmpty());
}

/// All rotors in one sentence, and what follows from it in none.
TEST(UnitDoubts, ThrustsInGrams) {
  EXPECT_THAT(
      doubts(runs_csv("n", {"1", "1", "1", "1", "1", "1"}, {"7.1", "7", "714", "718", "7.05", "7"})),
      ElementsAre("runs.csv:4 to runs.csv:5, column thrust_1_N: session S2 has 714 to 718, all others 7 "
                  "to 7.1; from gf these would be 7 to 7.04: another unit? It is so in thrust_2_N, "
                  "thrust_3_N, thrust_4_N too"));
}

std::vector<std::string> table_doubts(const std::string& top, const std::string& csv,
                                      const std::string& end = "") {
  const std::string schema = "format = \"tunnelrig-table/1\"\n" + top +
                             "[response]\ncolumn = \"T\"\nunit = \"gf\"\nmeaning = \"thrust_N\"\n"
                             "[[covariates]]\ncolumn = \"Tpipe\"\nunit = \"K\"\n" +
                             end;
  return unit_doubts(read_observations(parse_csv(csv, "t.csv"), parse_table_schema(schema, "s.toml")))
      .sentences;
}

constexpr const char* kTable =
    "day,rig,T,Tpipe,D\n1,a,714,293,9\n1,b,720,294,9\n2,a,7.02,293,9\n2,b,7.06,294,9\n3,a,716,67.5,9\n"
    "3,b,719,68.6,9\n4,a,715,294,9\n4,b,718,294,9\n";

TEST(UnitDoubts, ATableByItsBlocks) {
  EXPECT_THAT(
      table_doubts("blocks = \"day\"\n", kTable),
      ElementsAre("t.csv:4 to t.csv:5, column T: day 2 has 7.02 to 7.06, all others 714 to 720; from N "
                  "these would be 716 to 720: another unit?",
                  HasSubstr("t.csv:6 to t.csv:7, column Tpipe: day 3 has 67.5 to 68.6, all others 293 to "
                            "294; from degF these would be 293: another unit?")));
  EXPECT_THAT(table_doubts("", kTable), IsEmpty()) << "rows have nothing to compare with";
  EXPECT_THAT(table_doubts("groups = [\"rig\"]\n", kTable), IsEmpty());
  EXPECT_THAT(table_doubts("blocks = \"bins(T, 4)\"\n", kTable), IsEmpty());
}

TEST(UnitDoubts, ATableByItsGroups) {
  EXPECT_THAT(table_doubts("groups = [\"day\"]\nblocks = \"day\"\n", kTable),
              ElementsAre(HasSubstr("column T: group 2 has"), HasSubstr("column Tpipe: group 3 has")));
}

TEST(UnitDoubts, TheDiameterOfATable) {
  EXPECT_THAT(
      table_doubts("blocks = \"day\"\n", "day,T,Tpipe,D\n1,7,293,9\n2,7,293,228.6\n3,7,293,9\n",
                   "[propeller]\ndiameter_column = \"D\"\ndiameter_unit = \"in\"\n"),
      ElementsAre(HasSubstr("t.csv:3, column D: day 2 has 228.6, all others 9; from mm these would be 9")));
}

}  // namespace
}  // namespace tunnelrig
