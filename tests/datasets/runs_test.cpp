#include "datasets/campaign.h"
#include "datasets/locations.h"
#include "support/message_of.h"

#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

const char* const kHeader =
    "run,location,repeat,session,start_utc,raw,y_norm,z_norm,air_temperature_C,relative_humidity\n";

CampaignInfo reference() { return parse_campaign_toml(reference_campaign_toml(), "campaign.toml"); }

std::vector<Run> parse(const std::string& csv) { return parse_runs(parse_csv(csv, "runs.csv"), reference()); }

std::string refusal(const std::string& csv) {
  return message_of([&] { parse(csv); });
}

TEST(Runs, TypedFields) {
  const auto runs =
      parse(std::string(kHeader) + "R1,H4V-2,3,S1,2026-03-02T08:00:00Z,raw/R1.npy,0.8,-0.64,20.5,\n");
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].location, "H4V-2");
  EXPECT_EQ(runs[0].repeat, 3);
  EXPECT_EQ(runs[0].kind, RunKind::kThrust);
  EXPECT_EQ(runs[0].start_s, 1772438400);
  EXPECT_EQ(runs[0].y_norm, 0.8);
  EXPECT_EQ(runs[0].number("air_temperature_C"), 20.5);
  EXPECT_FALSE(runs[0].number("relative_humidity").has_value())
      << "an empty cell is not recorded, never zero";
}

TEST(Runs, UnknownColumnsAreCovariatesOrLabels) {
  const auto runs = parse(
      "run,location,repeat,session,start_utc,raw,fan_rpm,operator\n"
      "R1,OT,1,S1,2026-03-02T08:00Z,r.npy,1200,Kim\nR2,OT,2,S1,2026-03-02T08:10Z,r2.npy,,\n");
  EXPECT_EQ(runs[0].number("fan_rpm"), 1200);
  EXPECT_EQ(runs[0].labels.at("operator"), "Kim");
  EXPECT_FALSE(runs[1].number("fan_rpm").has_value());
  EXPECT_EQ(runs[1].labels.count("operator"), 0u);
}

TEST(Runs, NoNumberAmongNumbersIsRefused) {
  const std::string head =
      "run,location,repeat,session,start_utc,raw,fan_rpm\nR1,OT,1,S1,2026-03-02T08:00Z,r.npy,1200\n";
  for (const char* none : {"nan", "NaN", "NA", "#N/A", "inf", "null"})
    EXPECT_THAT(
        refusal(head + "R2,OT,2,S1,2026-03-02T08:10Z,r2.npy," + none + "\n"),
        HasSubstr(std::string("runs.csv:3: column fan_rpm: '") + none + "' is not a finite decimal number"));
}

TEST(Runs, AKnownQuantityInAnotherUnitIsRefusedInPlaceOfOurs) {
  const auto with = [](const std::string& columns) {
    return "run,location,repeat,session,start_utc,raw," + columns +
           "\nR1,OT,1,S1,2026-03-02T08:00Z,r.npy,1,2\n";
  };
  for (const auto& [theirs, ours] : std::vector<std::pair<std::string, std::string>>{
           {"air_temperature_degF", "air_temperature_C"},
           {"cell_temperature_F", "cell_temperature_C"},
           {"air_pressure_mmHg", "air_pressure_Pa"},
           {"air_pressure", "air_pressure_Pa"},
           {"relative_humidity_percent", "relative_humidity"},
           {"speed_Hz", "speed_rpm"},
           {"tunnel_airspeed_km_h", "tunnel_airspeed_m_s"},
           {"time_since_motor_start_min", "time_since_motor_start_s"},
           {"thrust_1_gf", "thrust_1_N"}}) {
    EXPECT_THAT(refusal(with(theirs + ",fan")),
                HasSubstr("runs.csv:1: column " + theirs + ": this quantity is read as " + ours));
  }
  EXPECT_EQ(parse(with("air_temperature_degF,air_temperature_C")).size(), 1u)
      << "beside ours it is a covariate";
  for (const char* other :
       {"ground_distance_m", "wall_distance_mm", "speed_of_fan", "thrust_1_old", "tilt_rad"})
    EXPECT_EQ(parse(with(std::string(other) + ",fan")).size(), 1u) << other;
}

TEST(Runs, SoAreThoseOfACalibrationAndOfPropellers) {
  EXPECT_THAT(
      message_of([] {
        parse_calibration(parse_csv("cell,applied_force_gf,voltage_V\n1,510,1.5\n", "calibration.csv"), 4);
      }),
      HasSubstr("calibration.csv:1: column applied_force_gf: this quantity is read as applied_force_N; "
                "convert it and rename the column"));
  EXPECT_THAT(message_of([] {
                parse_calibration(parse_csv("cell,applied_force_N,voltage_mV\n1,5,1500\n", "calibration.csv"),
                                  4);
              }),
              HasSubstr("column voltage_mV: this quantity is read as voltage_V"));
  EXPECT_THAT(message_of([] {
                parse_propellers(parse_csv("propeller,rotor,direction,thrust_gf\nA,1,CW,750\n", "p.csv"), 4);
              }),
              HasSubstr("p.csv:1: column thrust_gf: this quantity is read as thrust_N"));
}

TEST(Runs, DaysAreThoseOfTheCalendar) {
  EXPECT_FALSE(parse_utc("2026-02-30T08:00:00Z").has_value());
  EXPECT_FALSE(parse_utc("2026-02-29T08:00:00Z").has_value());
  EXPECT_TRUE(parse_utc("2028-02-29T08:00:00Z").has_value());
  EXPECT_EQ(parse_utc("2026-12-31T24:00:00Z"), parse_utc("2027-01-01T00:00:00Z"));
}

TEST(Runs, GridLabelsGiveTheirCoordinatesWhereNoneAreWritten) {
  const auto runs = parse(
      "run,location,repeat,session,start_utc,raw\nR1,H3V2,1,S1,2026-03-02T08:00Z,r.npy\n"
      "R2,OS,1,S1,2026-03-02T09:00Z,r2.npy\n");
  EXPECT_EQ(runs[0].y_norm, 0.6);
  EXPECT_EQ(runs[0].z_norm, 0.64);
  EXPECT_FALSE(runs[1].in_tunnel());
}

TEST(Runs, NamesFileLineAndColumn) {
  const std::string head = kHeader;
  EXPECT_THAT(refusal("run,location\n"), HasSubstr("runs.csv:1: the required column repeat is missing"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,a,0,0,abc,\n"),
              HasSubstr("runs.csv:2: column air_temperature_C: 'abc'"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,a,0,0,nan,\n"),
              HasSubstr("'nan' is not a finite"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,a,0,0,293.15,\n"),
              HasSubstr("degrees Celsius, not kelvin"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,a,0,0,-300,\n"),
              HasSubstr("-26.85 K: below absolute zero"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,a,0,0,20,45\n"),
              HasSubstr("a fraction from 0 to 1, not per cent"));
  EXPECT_THAT(refusal(head + "R1,OT,1.5,S1,2026-03-02T08:00Z,a,0,0,,\n"), HasSubstr("not a whole number"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,yesterday,a,0,0,,\n"), HasSubstr("'yesterday' is not an ISO 8601"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,a,0,,,\n"), HasSubstr("one of y_norm and z_norm"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,a,1.5,0,,\n"), HasSubstr("between -1 and 1"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,a,0,0,,\nR1,OT,2,S1,2026-03-02T08:00Z,b,0,0,,\n"),
              HasSubstr("runs.csv:3: run R1 stands twice; it is also in line 2"));
  EXPECT_THAT(refusal(head + "R1,OT,1,S1,2026-03-02T08:00Z,,0,0,,\n"), HasSubstr("thrust_1_N is empty"));
  EXPECT_THAT(refusal("run,location,repeat,session,start_utc,raw,air_temperature_K\n"),
              HasSubstr("this quantity is read as air_temperature_C"));
}

TEST(Campaign, NamesFileLineAndKey) {
  const auto refuse = [](const std::string& text) {
    return message_of([&] { parse_campaign_toml(text, "campaign.toml"); });
  };
  const std::string head = "format = \"tunnelrig-campaign/1\"\n";
  EXPECT_THAT(refuse("name = \"x\"\n"), HasSubstr("the key format is required"));
  EXPECT_THAT(refuse("format = \"tunnelrig-campaign/9\"\n"),
              HasSubstr("campaign.toml:1: format is \"tunnelrig-campaign/9\""));
  EXPECT_THAT(refuse(head), HasSubstr("the table [rig] is required"));
  EXPECT_THAT(refuse(head + "[rig]\nnominal_speed_rpm = 5000\npropeller_radius_m = 152.4\n"),
              HasSubstr("campaign.toml:4: rig.propeller_radius_m = 152.4: must lie between 0.005 and 5 m"));
  const std::string rig = head + "[rig]\nnominal_speed_rpm = 5000\npropeller_radius_m = 0.1524\n";
  EXPECT_THAT(refuse(rig + "rotors = 3.5\n"),
              HasSubstr("campaign.toml:5: rig.rotors = 3.5: must be a whole number"));
  EXPECT_THAT(refuse(rig + "[daq]\nadc_bits = 12.5\n"),
              HasSubstr("campaign.toml:6: daq.adc_bits = 12.5: must be a whole number"));
  EXPECT_THAT(refuse(head + "[rig]\npropeller_radius_m = 0.1524\n"),
              HasSubstr("rig.nominal_speed_rpm [rev/min] is required"));
  EXPECT_THAT(refuse(head + "[rig\n"), HasSubstr("campaign.toml:2:"));
  EXPECT_THAT(refuse(head + "[rig]\npropeller_radius_m = 0.1\nnominal_speed_rpm = 5000\nvehicle_width_m = "
                            "2\n[tunnel]\nwidth_m = 1.5\nheight_m = 1.5\n"),
              HasSubstr("does not fit the tunnel"));
}

TEST(Campaign, AreaDefaultsToOneDisc) {
  EXPECT_NEAR(reference().rig.rotor_area_m2, 0.0729658, 1e-6);
  EXPECT_NEAR(reference().daq.volts_per_count(), 3.3 / 4096, 1e-12);
}

TEST(Time, ReadsAndWritesIso8601) {
  EXPECT_EQ(parse_utc("1970-01-01T00:00:00Z"), 0);
  EXPECT_EQ(parse_utc("2026-03-02T08:00:00.250Z"), 1772438400.25);
  EXPECT_EQ(parse_utc("2026-03-02T10:00:00+02:00"), 1772438400);
  EXPECT_EQ(parse_utc("2026-03-02 08:00"), 1772438400);
  EXPECT_EQ(format_utc(1772438400), "2026-03-02T08:00:00Z");
  EXPECT_EQ(format_utc(1772438400.25), "2026-03-02T08:00:00.250Z");
  EXPECT_EQ(parse_utc("2026-03-02T05:30-0230"), 1772438400);
  EXPECT_EQ(parse_utc("2026-03-02T18:00:00+10"), 1772438400);
  for (const char* text : {"", "2026-03-02", "2026-13-02T08:00Z", "08:00", "2026-03-02T08:00:00Q",
                           "2026-03-02T08:00:00+05:30junk", "2026-03-02T08:00:00+-5:00",
                           "2026-03-02T08:00:00+", "2026-03-02T24:59:00Z", "2026-03-02T24:00:01Z"}) {
    EXPECT_FALSE(parse_utc(text)) << text;
  }
}

TEST(Locations, LabelsOfTheThesis) {
  EXPECT_EQ(tunnel_grid().size(), 42u);
  EXPECT_EQ(open_space_grid().size(), 1u + 10u + 9u);
  EXPECT_EQ(grid_point("H5V-3")->y_norm, 0.99);
  EXPECT_EQ(grid_point("H5V-3")->z_norm, -0.95);
  EXPECT_EQ(grid_point("OT")->z_norm, 0);
  EXPECT_EQ(canonical_location("H0V0"), "OT");
  EXPECT_EQ(distance_of("GND1.25", "GND"), 1.25);
  for (const char* label : {"H6V0", "H0V4", "HV", "OS", "H1", "H1V1.5", "H1e300V0", "H0V-1e300"})
    EXPECT_FALSE(grid_point(label)) << label;
}

}  // namespace
}  // namespace tunnelrig
