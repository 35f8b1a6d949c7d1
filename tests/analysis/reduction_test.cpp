#include "analysis/air.h"
#include "analysis/conventions.h"
#include "analysis/location_summary.h"
#include "analysis/reduction_output.h"
#include "datasets/csv.h"
#include "support/message_of.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

TEST(Air, Densities) {
  EXPECT_NEAR(dry_air_density_kg_m3(101325, 288.15), 1.2250, 1e-4);  // ISA
  EXPECT_NEAR(moist_air_density_kg_m3(101325, 293.15, 0), 1.2041, 1e-4);
  EXPECT_NEAR(moist_air_density_kg_m3(101325, 293.15, 0.5), 1.1988, 3e-4);  // CIPM-2007
  EXPECT_NEAR(saturation_pressure_Pa(293.15), 2339, 3);
  EXPECT_NEAR(air_viscosity_Pa_s(293.15), 1.813e-5, 1e-7);
  EXPECT_NEAR(speed_of_sound_m_s(288.15), 340.3, 0.1);
}

TEST(Conventions, ConvertBothWaysAndAgreeWithTheirDefinitions) {
  const Rig rig = parse_campaign_toml(reference_campaign_toml(), "campaign.toml").rig;
  const double density = 1.2, speed_rpm = 5000, thrust_N = 29.4;
  const double thesis = thrust_N / thesis_reference_thrust_N(density, speed_rpm, rig);
  const double omega = angular_speed_rad_s(speed_rpm), radius = rig.propeller_radius_m;
  const double helicopter =
      thrust_N / 4 / (density * M_PI * radius * radius * omega * omega * radius * radius);
  EXPECT_NEAR(convert_coefficient(thesis, Convention::kThesis, Convention::kHelicopter, rig), helicopter,
              1e-12);
  EXPECT_NEAR(convert_coefficient(thesis, Convention::kThesis, Convention::kPropeller, rig),
              propeller_coefficient(thrust_N / 4, density, speed_rpm, 2 * radius), 1e-12);
  for (const char* from : {"thesis", "helicopter", "propeller"}) {
    for (const char* to : {"thesis", "helicopter", "propeller"}) {
      const Convention a = convention_from_name(from), b = convention_from_name(to);
      EXPECT_NEAR(convert_coefficient(convert_coefficient(0.1, a, b, rig), b, a, rig), 0.1, 1e-15);
      EXPECT_EQ(name_of(a), from);
    }
  }
  EXPECT_NEAR(thesis, 0.1056, 0.001) << "3 kg on four rotors at 5000 rev/min is the thesis's coefficient";
}

/// Runs whose thrusts stand in the row: no calibration in the way.
CampaignData given_thrusts(const std::string& rows) {
  CampaignData data;
  data.info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
  data.runs = parse_runs(
      parse_csv("run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N,"
                "air_temperature_C,air_pressure_Pa,relative_humidity,speed_rpm\n" +
                    rows,
                "runs.csv"),
      data.info);
  return data;
}

TEST(Reduction, IsTheThesissFormula) {
  const CampaignData data =
      given_thrusts("R1,H4V-2,1,S1,2026-03-02T08:00Z,,7.1,7.4,7.6,7.2,20,100000,0.5,5010\n");
  const Reduction reduction = reduce_runs(data, {});
  ASSERT_EQ(reduction.runs.size(), 1u);
  const double density = 101325 / (287.058 * 293.15), omega = 5000 * 2 * M_PI / 60;
  const double area = M_PI * 0.1524 * 0.1524;
  EXPECT_NEAR(reduction.runs[0].c_t, 29.3 / (0.5 * density * omega * omega * 0.1524 * 0.1524 * area), 1e-12);
  EXPECT_NEAR(reduction.runs[0].u_percent, (7.1 + 7.2 - 7.4 - 7.6) / 29.3 * 100, 1e-12);
}

TEST(Reduction, TermsEnterByName) {
  const CampaignData data =
      given_thrusts("R1,OT,1,S1,2026-03-02T08:00Z,,7.1,7.4,7.6,7.2,20,100000,0.5,5010\n");
  const double thesis = reduce_runs(data, {}).runs[0].c_t;
  EXPECT_NEAR(reduce_runs(data, terms_from_names("air_pressure")).runs[0].c_t / thesis, 1.01325, 1e-9);
  EXPECT_NEAR(reduce_runs(data, terms_from_names("rotor_speed")).runs[0].c_t / thesis,
              std::pow(5000.0 / 5010, 2), 1e-12);
  EXPECT_NEAR(reduce_runs(data, terms_from_names("air_humidity")).runs[0].c_t / thesis, 1.0044, 2e-4);
  EXPECT_EQ(terms_from_names("rotor_speed,air_pressure").name(), "air_pressure+rotor_speed");
  EXPECT_EQ(terms_from_names("thesis").name(), "thesis");
  const CampaignData without = given_thrusts("R1,OT,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,5000\n");
  EXPECT_THAT(message_of([&] { reduce_runs(without, terms_from_names("air_pressure")); }),
              HasSubstr("run R1 has no air_pressure_Pa"));
}

TEST(Reduction, WhatCannotBeReducedIsNamed) {
  const CampaignData data = given_thrusts(
      "R1,OT,1,S1,2026-03-02T08:00Z,,7,7,7,7,,,,\nR2,OT,2,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\n"
      "R3,OT,3,S1,2026-03-02T08:00Z,,0,0,0,0,20,,,\n");
  const Reduction reduction = reduce_runs(data, {});
  EXPECT_EQ(reduction.runs.size(), 1u);
  ASSERT_EQ(reduction.left_out.size(), 2u);
  EXPECT_THAT(reduction.left_out[0].reason, HasSubstr("air_temperature_C"));
  EXPECT_THAT(reduction.left_out[1].reason, HasSubstr("were the motors running"));
}

TEST(Locations, OtAndH0V0AreOneAndOrderIsThatOfTheTunnel) {
  const CampaignData data = given_thrusts(
      "R1,GND2,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\nR2,H0V0,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\n"
      "R3,H1V-1,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\nR4,OT,2,S1,2026-03-02T08:00Z,,7.1,7.1,7.1,7.1,20,,,\n"
      "R5,OS,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\nR6,H1V2,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\n");
  const Summary summary = summarize_locations(data, reduce_runs(data, {}));
  std::vector<std::string> labels;
  for (const LocationSummary& location : summary.locations) labels.push_back(location.label);
  EXPECT_EQ(labels, (std::vector<std::string>{"OT", "H1V2", "H1V-1", "OS", "GND2"}));
  EXPECT_EQ(summary.locations[0].runs, 2);
  EXPECT_THAT(testing::PrintToString(summary.notes),
              HasSubstr("sessions: no location was measured in two sessions"));
}

TEST(Locations, ALabelAtTwoPlacesIsRefused) {
  CampaignData data = given_thrusts(
      "R1,X,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\nR2,X,2,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\n");
  data.runs[0].y_norm = data.runs[0].z_norm = 0.1;
  data.runs[1].y_norm = data.runs[1].z_norm = 0.2;
  EXPECT_THAT(message_of([&] { summarize_locations(data, reduce_runs(data, {})); }),
              HasSubstr("location X stands elsewhere than in run R1"));
}

TEST(Locations, CovarianceIsSymmetricAndHoldsTheVariances) {
  const CampaignData data = given_thrusts(
      "R1,OT,1,S1,2026-03-02T08:00Z,,7,7.1,7,7,20,,,\nR2,OT,2,S2,2026-03-03T08:00Z,,7.02,7,7.01,7,20,,,\n"
      "R3,OS,1,S1,2026-03-02T08:00Z,,6.9,7,7,7,20,,,\nR4,OS,2,S2,2026-03-03T08:00Z,,7.03,7,7.02,7,20,,,\n"
      "R5,H1V1,1,S1,2026-03-02T08:00Z,,6.9,7,7.1,7,20,,,\nR6,H1V1,2,S2,2026-03-03T08:00Z,,7.03,7.1,7.02,7,20,"
      ",,\n");
  const Summary summary = summarize_locations(data, reduce_runs(data, {}));
  EXPECT_TRUE(summary.c_t_covariance.isApprox(summary.c_t_covariance.transpose()));
  for (std::size_t l = 0; l < summary.locations.size(); ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    EXPECT_NEAR(std::sqrt(summary.c_t_covariance(row, row)), summary.locations[l].c_t.standard_uncertainty,
                1e-12);
    EXPECT_NEAR(std::sqrt(summary.u_covariance(row, row)),
                summary.locations[l].u_percent.standard_uncertainty, 1e-9);
  }
}

/// One run at each location, from means without raw data: no repeat and no noise says how far C_T scatters.
TEST(Locations, WithoutRepeatsOrRawDataTheUncertaintyIsNotKnown) {
  const CampaignData data = given_thrusts(
      "R1,OT,1,S1,2026-03-02T08:00Z,,7,7.1,7,7,20,,,\nR2,OS,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\n");
  const Reduction reduction = reduce_runs(data, {});
  const Summary summary = summarize_locations(data, reduction);
  for (const LocationSummary& location : summary.locations) {
    EXPECT_TRUE(std::isnan(location.c_t.u95));
    EXPECT_TRUE(std::isnan(location.u_percent.u95));
  }
  EXPECT_THAT(testing::PrintToString(summary.notes), HasSubstr("how far C_T and U scatter is not known"));
  const Sheet sheet =
      parse_csv(locations_csv(summary, reduction, data.info.rig, Convention::kThesis), "out.csv");
  for (const char* column : {"c_t_u95", "u_percent_u95", "c_t_u_run"})
    EXPECT_EQ(sheet.text(0, column), "") << column;
}

TEST(ReductionOutput, CsvColumnsAreInTheirOrderAndEmptyMeansNotKnown) {
  const CampaignData data = given_thrusts(
      "R1,OT,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,\nR2,OS,1,S2,2026-03-02T08:00Z,,7,7,7,7,20,,,\n");
  const Reduction reduction = reduce_runs(data, {});
  const Summary summary = summarize_locations(data, reduction);
  const Sheet sheet =
      parse_csv(locations_csv(summary, reduction, data.info.rig, Convention::kThesis), "out.csv");
  EXPECT_EQ(sheet.columns[0] + sheet.columns[4] + sheet.columns[9], "locationc_tu_percent_u95");
  EXPECT_EQ(sheet.text(0, "c_t_std"), "") << "one run has no standard deviation";
  EXPECT_EQ(sheet.text(1, "y_norm"), "");
  EXPECT_EQ(sheet.require_number(0, "y_norm"), 0);
}

}  // namespace
}  // namespace tunnelrig
