#include "analysis/implausible_thrust.h"

#include "datasets/csv.h"

#include <array>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Three runs at two places, whose thrusts stand in the row.
CampaignData thrusts_N(const std::array<std::string, 3>& cells, double radius_m = 0.1524,
                       double nominal_rpm = 5000) {
  CampaignData data;
  data.info = parse_campaign_toml(
      fmt::format(
          "format = \"tunnelrig-campaign/1\"\n[rig]\npropeller_radius_m = {}\nnominal_speed_rpm = {}\n",
          radius_m, nominal_rpm),
      "campaign.toml");
  data.runs = parse_runs(
      parse_csv(
          fmt::format(
              "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N,"
              "air_temperature_C\nR1,OT,1,S1,2026-03-02T08:00Z,,{},20\nR2,OT,2,S1,2026-03-02T08:10Z,,{},20\n"
              "R3,H1V1,1,S1,2026-03-02T08:20Z,,{},20\n",
              cells[0], cells[1], cells[2]),
          "runs.csv"),
      data.info);
  return data;
}

std::string found(const CampaignData& data) {
  const auto doubt = implausible_thrust(data);
  return doubt ? doubt->found + ": " + doubt->advice : "";
}

TEST(ImplausibleThrust, NothingIsSaidOfWhatRotorsDo) {
  const std::string sound = "7.1,7.4,7.6,7.2";
  EXPECT_EQ(found(thrusts_N({sound, sound, sound})), "");
  EXPECT_EQ(found(thrusts_N({sound, sound, "0.01,0.02,-0.01,0"})), "") << "blades off at one place";
  EXPECT_EQ(found(thrusts_N({"0,7,0,0", "0,7,0,0", "0,7,0,0"})), "") << "three rotors stand";
  EXPECT_EQ(found(thrusts_N({"-2,7,7,7", sound, sound})), "") << "one pulls the other way";
  for (const double c : {0.012, 0.046}) {  // the extremes of UIUC's static points
    const double each = c / 0.3 * 83.6;
    const std::string cells = fmt::format("{0},{0},{0},{0}", each);
    EXPECT_EQ(found(thrusts_N({cells, cells, cells})), "") << c;
  }
  EXPECT_EQ(found(thrusts_N({"-1,0,0,0", "-1,0,0,0", "-1,0,0,0"})), "") << "nothing can be reduced";
}

TEST(ImplausibleThrust, GramsOfOneCellAtOnePlace) {
  const std::string sound = "7.1,7.4,7.6,7.2";
  EXPECT_THAT(found(thrusts_N({sound, sound, "7.1,7.4,775,7.2"})),
              AllOf(HasSubstr("location H1V1: rotor 3 gives 775 N and C_T is 2."),
                    HasSubstr("a rotor of 0.1524 m radius gives 83.6 N at most at 5000 rev/min (so at 1 of 2 "
                              "locations)"),
                    HasSubstr("in grams?")));
}

TEST(ImplausibleThrust, KilogramsADiameterAndAWrongSpeed) {
  const std::string sound = "7.1,7.4,7.6,7.2", kilograms = "0.72,0.75,0.77,0.73";
  EXPECT_THAT(found(thrusts_N({kilograms, kilograms, kilograms})),
              AllOf(HasSubstr("rotor 3 gives 0.77 N"), HasSubstr("no rotor gives more anywhere"),
                    HasSubstr("in kilograms")));
  EXPECT_THAT(found(thrusts_N({sound, sound, sound}, 0.3048)), HasSubstr("rig.propeller_radius_m"));
  EXPECT_THAT(found(thrusts_N({sound, sound, sound}, 0.1524, 500)), HasSubstr("so at 2 of 2 locations"));
}

TEST(ImplausibleThrust, ACellOfTheWrongSign) {
  const std::string mirrored = "-7.1,7.4,7.6,7.2";
  const CampaignData most = thrusts_N({mirrored, mirrored, "7.1,7.4,7.6,7.2"});
  EXPECT_THAT(found(most),
              AllOf(HasSubstr("rotor 1 gives -7.1 N where another gives 7.6 N, so in 2 of 3 runs: "),
                    HasSubstr("wrong sign")));
  EXPECT_TRUE(implausible_thrust(most)->certain);
  const std::string two = "-7.1,7.4,-7.2,7.3";
  EXPECT_THAT(found(thrusts_N({two, two, two})),
              HasSubstr("; rotor 3 gives -7.2 N where another gives 7.4 N, so in 3 of 3 runs"));
}

TEST(ImplausibleThrust, SignsThatAreNoMistake) {
  const std::string back = "-7.1,-7.4,-7.6,-7.2", noise = "0.02,-0.01,0.01,-0.01",
                    stands = "-0.3,7.4,7.6,7.2";
  for (const std::string& cells : {back, noise, stands}) {
    const std::string said = found(thrusts_N({cells, cells, cells}));
    EXPECT_EQ(said.find("sign"), std::string::npos) << cells << ": " << said;
  }
}

/// Rows of one group each, by the propeller's convention.
std::string found_of_table(const std::vector<double>& c_t, Convention convention = Convention::kPropeller) {
  TableReduction reduction{.name = "", .convention = convention, .rows = {}, .groups = {}};
  for (const double value : c_t) {
    reduction.groups.push_back({.name = fmt::format("g{}", reduction.groups.size()),
                                .rows = {reduction.rows.size()},
                                .median = value});
    reduction.rows.push_back({.group = reduction.groups.back().name, .c_t = value, .place = ""});
  }
  const auto doubt = implausible_thrust(reduction);
  return doubt ? doubt->found : "";
}

TEST(ImplausibleThrust, OfTables) {
  EXPECT_EQ(found_of_table({0.048, 0.18, -0.1, 0.34}), "");
  EXPECT_THAT(found_of_table({0.1, 4e-8, 0.1}),
              HasSubstr("group g1: its largest C_T of 4e-08 is less than any "
                        "propeller's (0.012 at least); so in 1 of 3 groups"));
  EXPECT_THAT(found_of_table({2e5}),
              HasSubstr("a median C_T of 2e+05 is more than any propeller's (1.2 at most)"));
  EXPECT_EQ(found_of_table({0.02}, Convention::kThesis), "");
  EXPECT_THAT(found_of_table({0.5}, Convention::kThesis), HasSubstr("(0.3 at most)"));
}

}  // namespace
}  // namespace tunnelrig
