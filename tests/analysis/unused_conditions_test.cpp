// What the model holds constant and was recorded otherwise is said beside U95, which does not hold it.
#include "analysis/unused_conditions.h"

#include "analysis/location_summary.h"
#include "datasets/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Six runs whose columns for pressure, humidity and speed are these.
CampaignData campaign_under(const std::string& conditions) {
  std::string rows =
      "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N,"
      "air_temperature_C,air_pressure_Pa,relative_humidity,speed_rpm\n";
  for (int run = 1; run <= 6; ++run)
    rows += fmt::format("R{0},{1},{2},S{2},2026-03-0{2}T08:00Z,,7.0{0},7,7,7,20,{3}\n", run,
                        run % 2 == 0 ? "OT" : "OS", (run + 1) / 2, conditions);
  CampaignData data;
  data.info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
  data.runs = parse_runs(parse_csv(rows, "runs.csv"), data.info);
  return data;
}

std::string notes(const CampaignData& data, const char* terms = "thesis") {
  return testing::PrintToString(summarize_locations(data, reduce_runs(data, terms_from_names(terms))).notes);
}

TEST(UnusedConditions, APressureThatWasRecordedAndNotUsedIsSaidInPerCentOfC_TBesideU95) {
  const CampaignData data = campaign_under("95000,,");
  EXPECT_THAT(notes(data),
              HasSubstr("pressure: taken for 101325 Pa; as recorded (95000 Pa on average) it makes "
                        "C_T 6.66 % greater than it stands here, where U95 is 0."));
  EXPECT_THAT(notes(data), HasSubstr("`reduce --with air_pressure` takes it in"));
  EXPECT_THAT(notes(data, "air_pressure"), Not(HasSubstr("taken for 101325 Pa")));
}

TEST(UnusedConditions, SoAreHumidityAndSpeed) {
  const CampaignData data = campaign_under(",0.5,5025");
  EXPECT_THAT(notes(data), HasSubstr("humidity: the air is taken for dry; as recorded (50 % on average) it "
                                     "makes C_T 0.44 % greater"));
  EXPECT_THAT(notes(data), HasSubstr("speed: taken for nominal (5000 rev/min); as recorded (5025 rev/min on "
                                     "average) it makes C_T 0.99 % less"));
  EXPECT_THAT(notes(data, "air_humidity,rotor_speed"), Not(HasSubstr("taken for nominal")));
  EXPECT_THAT(notes(data, "air_humidity,rotor_speed"), Not(HasSubstr("taken for dry")));
}

TEST(UnusedConditions, WhatWasNotRecordedIsSaidToo) {
  const std::string said = notes(campaign_under(",,"));
  for (const char* quantity : {"pressure: taken for 101325 Pa, and not recorded",
                               "humidity: the air is taken for dry, and not recorded",
                               "speed: taken for nominal (5000 rev/min), and not recorded"})
    EXPECT_THAT(said, HasSubstr(quantity));
}

TEST(UnusedConditions, TheLocationThatIsFurthestFromTheMeanIsNamed) {
  CampaignData data = campaign_under("101325,,5000");
  for (tunnelrig::Run& run : data.runs)
    if (run.location == "OS") run.numbers["speed_rpm"] = 4900;
  const std::string said = notes(data);
  EXPECT_THAT(said, HasSubstr("it makes C_T 2.06 % greater than it stands here, that of OS 4.12 % greater"));
  EXPECT_THAT(notes(campaign_under("101325,,5000")), Not(HasSubstr("speed: taken for nominal")));
  EXPECT_THAT(said, HasSubstr("C_T 0.00 % greater than it stands here, where")) << "all alike: " << said;
}

TEST(UnusedConditions, AnAdoptedEffectTakesItsConditionIn) {
  const CampaignData data = campaign_under("95000,,");
  AppliedModel model;
  model.effect_names = {"air_pressure"};
  for (const UnusedCondition& condition : unused_conditions(data, {0, 1}, {}, model))
    EXPECT_NE(condition.quantity, "pressure");
}

}  // namespace
}  // namespace tunnelrig
