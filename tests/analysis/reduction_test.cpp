#include "analysis/air.h"
#include "analysis/conventions.h"
#include "analysis/location_summary.h"
#include "analysis/maps/field_data.h"
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
  EXPECT_THAT(message_of([] { terms_from_names("foo"); }), HasSubstr("--with: 'foo' is no term"));
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

TEST(ReductionOutput, ThrustsOfTheSheetHaveNoNoiseAndAllTheirDigits) {
  const CampaignData data =
      given_thrusts("R1,OT,1,S1,2026-03-02T08:00Z,,0.00123456,0.00123,0.00123,0.00123,20,,,\n");
  const Reduction reduction = reduce_runs(data, {});
  const Sheet runs = parse_csv(runs_csv(data, reduction, Convention::kThesis), "runs.csv");
  EXPECT_EQ(runs.text(0, "c_t_standard_error"), "") << "not known, not 0";
  EXPECT_EQ(runs.require_number(0, "thrust_1_N"), 0.00123456) << "of a rotor of a few millimetres";
}

TEST(Reduction, ASpeedOfZeroHasNoC_T) {
  const CampaignData data = given_thrusts(
      "R1,OT,1,S1,2026-03-02T08:00Z,,7,7,7,7,20,,,0\nR2,OT,2,S1,2026-03-02T09:00Z,,7,7,7,7,20,,,5000\n");
  EXPECT_EQ(reduce_runs(data, {}).runs.size(), 2u) << "the thesis takes the nominal one";
  const Reduction reduction = reduce_runs(data, terms_from_names("rotor_speed"));
  ASSERT_EQ(reduction.left_out.size(), 1u);
  EXPECT_THAT(reduction.left_out[0].reason, HasSubstr("speed_rpm is 0"));
}

/// Propellers' factors are divided out of what cells read; thrusts of the sheet are as they are.
TEST(Locations, ThrustsOfTheSheetHaveNoPropellersUncertainty) {
  CampaignData data = given_thrusts(
      "R1,OT,1,S1,2026-03-02T08:00Z,,7.1,7.4,7.6,7.2,20,,,\nR2,OT,2,S1,2026-03-02T09:00Z,,7.2,7.3,7.5,7.3,20,"
      ",,\n");
  std::vector<CalibrationPoint> points;
  std::vector<PropellerTest> tests;
  for (int rotor = 1; rotor <= 4; ++rotor)
    for (int p = 0; p < 5; ++p) {
      points.push_back({.cell = rotor,
                        .applied_force_N = 2.0 * p,
                        .voltage_V = 0.3 + 0.5 * p + 1e-4 * (p % 2),
                        .line = p + 2});
      tests.push_back({.propeller = std::string(1, static_cast<char>('A' + rotor)),
                       .rotor = rotor,
                       .direction = rotor < 3 ? "CCW" : "CW",
                       .thrust_N = 7.4 + 0.1 * p,
                       .line = p + 2});
    }
  const double alone = summarize_locations(data, reduce_runs(data, {})).locations[0].u_percent.u95;
  data.certificate = calibrate(points, tests);
  const LocationSummary location = summarize_locations(data, reduce_runs(data, {})).locations[0];
  EXPECT_EQ(location.budget.propellers, 0);
  EXPECT_DOUBLE_EQ(location.u_percent.u95, alone);
  EXPECT_THAT(
      testing::PrintToString(summarize_locations(data, reduce_runs(data, {})).notes),
      HasSubstr("thrusts: those of 2 of 2 runs stand in runs.csv (thrust_i_N), and what their calibration"));
}

/// An anchor once a session, every other place once: what runs and sessions scatter is known together.
TEST(Locations, AnAnchorTellsWhatSinglesScatter) {
  std::string rows;
  int run = 0;
  for (int session = 1; session <= 4; ++session)
    for (const char* place : {"OT", "", ""}) {
      const double thrust = 7 + 0.1 * (session % 3) + 0.02 * run;
      rows += fmt::format("R{},{},1,S{},2026-03-0{}T08:{:02}Z,,{},{},{},{},20,,,\n", run,
                          *place != '\0' ? std::string(place) : fmt::format("H1V{}", run - 6), session,
                          session, run % 60, thrust, thrust, thrust, thrust);
      ++run;
    }
  const CampaignData data = given_thrusts(rows);
  const Summary summary = summarize_locations(data, reduce_runs(data, {}));
  for (const LocationSummary& location : summary.locations) {
    EXPECT_GT(location.c_t.u95, 0.3 * summary.locations[0].c_t.std) << location.label;
    if (location.label == "OT") {
      EXPECT_GT(location.c_t.u95, 1.2 * location.c_t.std);
    }
  }
  EXPECT_THAT(testing::PrintToString(summary.notes), HasSubstr("cannot be told apart"));
}

TEST(ReductionOutput, RotorsAverageToC_TOfOneRotorAndTextsKeepToTheirCells) {
  CampaignData data = given_thrusts(
      "R1,\"on the \"\"left\"\", low\",1,S1,2026-03-02T08:00Z,,7.1,7.4,7.6,7.2,20,,,\n"
      "R2,\"on the \"\"left\"\", low\",2,S1,2026-03-02T09:00Z,,7.2,7.3,7.5,7.3,20,,,\n");
  const Reduction reduction = reduce_runs(data, {});
  const Summary summary = summarize_locations(data, reduction);
  for (const Convention convention : {Convention::kThesis, Convention::kHelicopter, Convention::kPropeller}) {
    const Sheet sheet =
        parse_csv(locations_csv(summary, reduction, data.info.rig, convention), "locations.csv");
    EXPECT_EQ(sheet.text(0, "location"), "on the \"left\", low");
    double sum = 0;
    for (int rotor = 1; rotor <= 4; ++rotor) sum += *sheet.number(0, fmt::format("c_rotor_{}", rotor));
    EXPECT_NEAR(sum / (convention == Convention::kThesis ? 1 : 4), *sheet.number(0, "c_t"), 1e-6);
  }
  EXPECT_EQ(parse_csv(runs_csv(data, reduction, Convention::kThesis), "runs.csv").text(1, "location"),
            "on the \"left\", low");
}

/// Four places, each twice in two sessions, in all sorts of scatter.
CampaignData small_campaign() {
  std::string rows;
  int run = 0;
  for (int session = 1; session <= 2; ++session)
    for (const char* place : {"OT", "H2V0", "H4V2", "H4V-2"})
      for (int repeat = 1; repeat <= 2; ++repeat, ++run) {
        const double wave = 0.02 * std::sin(3.0 * run);
        rows += fmt::format("R{},{},{},S{},2026-03-0{}T08:{:02}Z,,{},{},{},{},20,,,\n", run, place, repeat,
                            session, session, run, 7.1 + wave, 7.4 - wave, 7.2 + 0.01 * session, 7.3);
      }
  return given_thrusts(rows);
}

TEST(Locations, TheMapsU95OfUIsTheirs) {
  const CampaignData data = small_campaign();
  const Summary summary = summarize_locations(data, reduce_runs(data, {}));
  const auto measured = measured_locations(merge_locations(map_input(data, summary, "c.db")));
  ASSERT_EQ(measured.size(), 4u);
  for (std::size_t l = 0; l < measured.size(); ++l) {
    const LocationValue& u = summary.locations[l].u_percent;
    ASSERT_LT(u.dof, 20);
    EXPECT_NEAR(measured[l].uneven_thrust_u95_percent, u.u95, 1e-9) << measured[l].label;
  }
}

TEST(Locations, ThoseThatAreNotOnTheMapAreNamed) {
  std::string rows;
  for (const char* label : {"OT", "h4v2", "OS", "GND2", "CEIL1.5", "bench", "left corner"})
    rows += fmt::format("{},{},1,S1,2026-03-02T08:00Z,,7.1,7.4,7.2,7.3,20,,,\n", label, label);
  CampaignData data = given_thrusts(rows);
  data.runs[5].numbers["ground_distance_R"] = 2;
  const Summary summary = summarize_locations(data, reduce_runs(data, {}));
  EXPECT_THAT(not_on_the_map(data, summary), testing::UnorderedElementsAre("h4v2", "left corner"));
}

}  // namespace
}  // namespace tunnelrig
