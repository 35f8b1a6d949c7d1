#include "datasets/import_doubts.h"

#include <algorithm>
#include <functional>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kToml =
    "format = \"tunnelrig-campaign/1\"\nlaboratory = \"ours\"\n[rig]\npropeller_radius_m = 0.15\n"
    "nominal_speed_rpm = 5000\n[tunnel]\nwidth_m = 1.5\nheight_m = 1.5\n";

std::vector<std::string> doubts(const std::string& toml, const std::string& csv) {
  const CampaignInfo info = parse_campaign_toml(toml, "campaign.toml");
  const Sheet sheet = parse_csv(csv, "runs.csv");
  return import_doubts(info, sheet, parse_runs(sheet, info));
}

/// Six runs at one place; `cells` are appended to their lines.
std::string runs(const std::string& column, const std::vector<std::string>& cells,
                 const std::string& thrusts = "7,7,7,7") {
  std::string csv = "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N," +
                    column + "\n";
  for (std::size_t r = 0; r < cells.size(); ++r)
    csv += fmt::format("R{},H1V1,{},S1,2026-03-02T08:0{}:00Z,,{},{}\n", r, r + 1, r, thrusts, cells[r]);
  return csv;
}

const std::vector<std::string> kNumbers = {"1", "2", "", "3", "4", "5"};

TEST(ImportDoubts, NothingIsSaidOfASoundCampaign) {
  EXPECT_THAT(doubts(kToml, runs("fan_rpm", kNumbers)), IsEmpty());
}

TEST(ImportDoubts, KeysThatNothingReads) {
  EXPECT_THAT(doubts(std::string(kToml) + "[uncertanty]\nforce_N = 0.1\n", runs("fan_rpm", kNumbers)),
              ElementsAre("campaign.toml:9: nothing reads [uncertanty]"));
  EXPECT_THAT(doubts(std::string(kToml) + "lenght_m = 20\n", runs("fan_rpm", kNumbers)),
              ElementsAre(HasSubstr("campaign.toml:9: nothing reads tunnel.lenght_m; known are width_m")));
}

TEST(ImportDoubts, ATextAmongNumbersMakesALabel) {
  EXPECT_THAT(doubts(kToml, runs("fan_rpm", {"1", "2", "\"3,5\"", "3", "4", "5"})),
              ElementsAre(HasSubstr("runs.csv:4: column fan_rpm: '3,5' is no number, as 5 other cells are")));
  EXPECT_THAT(doubts(kToml, runs("propeller", {"1", "2", "spare", "3", "4", "spare"})), IsEmpty())
      << "many texts are labels";
}

/// Of 24 runs, an hour apart, six in a session.
std::string day_by_day(const std::function<double(int)>& temperature_C, double hours_between = 1) {
  std::string csv =
      "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N,air_temperature_"
      "C\n";
  for (int r = 0; r < 24; ++r)
    csv +=
        fmt::format("R{},H1V1,{},S{},{},,7,7,7,7,{}\n", r, r + 1, r / 6,
                    format_utc(1.77e9 + 86400. * (r / 6) + 3600 * hours_between * (r % 6)), temperature_C(r));
  return csv;
}

TEST(ImportDoubts, ASensorThatIsStuck) {
  EXPECT_THAT(doubts(kToml, day_by_day([](int r) { return 20 + 0.1 * r; })), IsEmpty());
  EXPECT_THAT(
      doubts(kToml, day_by_day([](int r) { return 20 + 0.1 * std::min(r, 14); })),
      ElementsAre(HasSubstr("runs.csv:16 to runs.csv:25, column air_temperature_C: 21.4 in 10 runs on end")));
  EXPECT_THAT(doubts(kToml, day_by_day([](int r) { return r < 12 ? 20 + r % 3 : 20; })), IsEmpty())
      << "few values are settings";
}

TEST(ImportDoubts, ASessionOfSeveralDays) {
  EXPECT_THAT(doubts(kToml, day_by_day([](int r) { return 20 + 0.1 * r; }, 5)),
              Contains(HasSubstr("session S0 goes on from")));
}

TEST(ImportDoubts, ALocationOffTheGrid) {
  std::string csv = day_by_day([](int r) { return 20 + 0.1 * r; });
  for (const char* label : {"H-4V0", "H1V4", "door"}) {
    std::string off = csv;
    off.replace(off.find("H1V1"), 4, label);
    EXPECT_THAT(doubts(kToml, off),
                ElementsAre(AllOf(HasSubstr(fmt::format("runs.csv:2: location '{}'", label)),
                                  HasSubstr("1 run counts as in no tunnel"))));
  }
  csv.replace(csv.find("H1V1"), 4, "GND2");
  EXPECT_THAT(doubts(kToml, csv), IsEmpty());
}

TEST(ImportDoubts, AColumnThatIsOursButForCapitals) {
  EXPECT_THAT(
      doubts(kToml, runs("Excluded,Relative_Humidity", {"gust,0.4", ",0.5", ",", ",0.4"})),
      ElementsAre("runs.csv:1: column 'Excluded' is kept as a label; is 'excluded' meant?",
                  "runs.csv:1: column 'Relative_Humidity' is kept as a covariate; is 'relative_humidity' "
                  "meant?"));
  EXPECT_THAT(doubts(kToml, runs("Kind,LOCATION", {"tare,x"})),
              ElementsAre(HasSubstr("is 'kind' meant?"), HasSubstr("is 'location' meant?")));
  EXPECT_THAT(doubts(kToml, runs("excluded,kinds", {",a"})), IsEmpty());
}

TEST(ImportDoubts, AConditionThatNothingReads) {
  EXPECT_THAT(
      doubts(kToml, runs("run_order", kNumbers)),
      ElementsAre("runs.csv:1: column run_order is not read: that condition is made of the runs' times"));
  EXPECT_THAT(
      doubts(kToml, runs("wall_distance_mm", kNumbers)),
      ElementsAre("runs.csv:1: column wall_distance_mm is kept as a condition without a meaning: effects "
                  "read this quantity as wall_distance_R"));
}

TEST(ImportDoubts, GramsAreNoNewtons) {
  EXPECT_THAT(
      doubts(kToml, runs("fan_rpm", kNumbers, "700,7,7,7")),
      ElementsAre(HasSubstr("runs.csv:2: column thrust_1_N: 700 N is more than a rotor of 0.15 m radius")));
}

/// The area of the thrust coefficient is a convention; what a rotor gives is not.
TEST(ImportDoubts, TheLargestThrustIsThatOfTheDisc) {
  std::string toml = kToml;
  toml.insert(toml.find("[tunnel]"), "rotor_area_m2 = 0.005\n");
  EXPECT_THAT(doubts(toml, runs("fan_rpm", kNumbers)), IsEmpty());
}

/// What is said of runs of four channels, each between two values.
std::vector<std::string> volt_doubts(const std::vector<std::pair<double, double>>& runs_V,
                                     SampleType type = SampleType::kFloat64) {
  const CampaignInfo info = parse_campaign_toml(kToml, "campaign.toml");
  VoltDoubt doubt(info);
  int line = 2;
  for (const auto& [lowest_V, highest_V] : runs_V) {
    Run run;
    run.run = fmt::format("R{}", line);
    run.raw = fmt::format("raw/R{}.npy", line);
    run.line = line++;
    RunStatistics statistics;
    statistics.channels.resize(5, {.lowest_V = 0.3, .highest_V = 2});
    statistics.channels[1].lowest_V = lowest_V;
    statistics.channels[1].highest_V = highest_V;
    statistics.channels[4].highest_V = 1e4;  // no rotor's: anything may be recorded there
    doubt.look_at(run, {type, 5}, statistics);
  }
  return doubt.doubts();
}

TEST(ImportDoubts, VoltsBeyondTheConverterAreNoVolts) {
  EXPECT_THAT(volt_doubts({{0.3, 3.3}, {-3.3, 2}, {0, 3.301}}), IsEmpty());
  EXPECT_THAT(
      volt_doubts({{0.3, 2}, {300, 2734}, {300, 2500}}),
      ElementsAre("runs.csv:3: run R3: channel 2 of raw/R3.npy holds 2734 V, beyond the converter's "
                  "reference of 3.3 V (daq.adc_reference_V): are these volts (not counts or mV)? It is "
                  "so in 2 runs"));
  EXPECT_THAT(volt_doubts({{-2048, 2047}}), ElementsAre(HasSubstr("holds -2048 V")));
  EXPECT_THAT(volt_doubts({{300, 2734}}, SampleType::kInt16), IsEmpty()) << "counts are another rule's";
}

TEST(ImportDoubts, RunsDoNotBeginWithinOthers) {
  const auto doubts_at = [](double rate_hz, const std::vector<double>& starts_s, std::uint64_t lost = 1) {
    CampaignInfo info = parse_campaign_toml(kToml, "campaign.toml");
    info.daq.sample_rate_hz = rate_hz;
    OverlapDoubt doubt(info);
    int line = 2;
    for (const double start_s : starts_s) {
      tunnelrig::Run run;
      run.run = fmt::format("R{}", line);
      run.line = line++;
      run.start_s = start_s;
      RunStatistics statistics;
      statistics.frames = 80000;
      doubt.look_at(run, statistics, std::vector<Gap>{{.first_frame = 100, .frames_lost = lost}});
    }
    return doubt.doubts();
  };
  EXPECT_THAT(doubts_at(4000. / 3, {0, 200, 120, 60}), IsEmpty()) << "to the minute, and in any order";
  EXPECT_THAT(
      doubts_at(4. / 3, {0, 120, 200}),
      ElementsAre("runs.csv:3: run R3 begins 120 s after run R2, which by its frames lasts 6e+04 s: are "
                  "daq.sample_rate_hz = 1.33333 and start_utc right? It is so of 2 runs"));
  EXPECT_THAT(doubts_at(4000. / 3, {500, 500}), ElementsAre(HasSubstr("begins 0 s after run R2")));
  EXPECT_THAT(doubts_at(4000. / 3, {0, 200}, 100'000'000'000),
              ElementsAre(HasSubstr("run R2, which by its frames lasts 7.5e+07 s")))
      << "lost ones are frames too, however many";
}

TEST(ImportDoubts, AColumnHasAName) {
  EXPECT_THAT(
      doubts(kToml,
             ",run,location,repeat,session,start_utc,raw\n0,A,OT,1,S,2026-03-02T08:00:00Z,raw/A.npy\n"),
      ElementsAre(HasSubstr("runs.csv:1: a column without a name: kept as it stands")));
}

TEST(ImportDoubts, ALocationStandsAtOnePlace) {
  const std::string head =
      "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N,";
  EXPECT_THAT(doubts(kToml, head + "y_norm,z_norm\nA,here,1,S,2026-03-02T08:00:00Z,,7,7,7,7,0.1,0\n"
                                   "B,here,2,S,2026-03-02T08:10:00Z,,7,7,7,7,0.2,0\n"),
              ElementsAre("runs.csv:3: location here stands elsewhere than in run A: it cannot be reduced"));
}

TEST(ImportDoubts, AnArrayIsOfOneRun) {
  EXPECT_THAT(doubts(kToml,
                     "run,location,repeat,session,start_utc,raw\n"
                     "A,H1V1,1,S,2026-03-02T08:00:00Z,raw/A.npy\n"
                     "B,H1V1,2,S,2026-03-02T08:10:00Z,raw//A.npy\n"),
              ElementsAre("runs.csv:3: run B has the array of run A, raw//A.npy: was the row copied?"));
}

}  // namespace
}  // namespace tunnelrig
