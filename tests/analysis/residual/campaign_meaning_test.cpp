// What a campaign's runs mean for its observations: zeros that tares have taken, cells in volts, one rotor,
// open space.
#include "analysis/model/adopt.h"
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr double kGain_V_per_N = 0.24, kZero_V = 0.33;

/// Runs of volts, made here: 14 sessions of 12 runs at three places, whose zeros are told by `tares`.
struct CampaignMeaning : testing::Test {
  enum class Tares { kNone, kBefore, kBothEnds };
  std::mt19937_64 random{test::seed()};
  CampaignData data;

  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(random); }

  CampaignMeaning() { data.info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml"); }

  void calibrate_cells() {
    std::vector<CalibrationPoint> points;
    for (int cell = 1; cell <= data.info.rig.rotors; ++cell)
      for (int p = 0; p < 8; ++p)
        points.push_back({.cell = cell,
                          .applied_force_N = 1.2 * p,
                          .voltage_V = kZero_V + kGain_V_per_N * 1.2 * p + normal(1e-5),
                          .line = p + 2});
    data.certificate = calibrate(points, {}, {.rotors = data.info.rig.rotors, .cell = {}, .limits = {}});
  }

  void add_run(int session, int minute, RunKind kind, const std::string& place, double cell_C, double extra_V,
               double force_N) {
    tunnelrig::Run run;
    run.run = "R" + std::to_string(data.runs.size());
    run.location = place;
    run.session = "S" + std::to_string(session);
    run.repeat = static_cast<int>(data.runs.size());
    run.kind = kind;
    run.start_s = 86400.0 * session + 60 * minute;
    const double air_C = run.numbers["air_temperature_C"] = 20 + normal(1);
    force_N *= 293.15 / (air_C + 273.15);
    run.numbers["cell_temperature_C"] = cell_C;
    RunStatistics statistics{.hash = "h", .frames = 1333};
    for (int c = 0; c < data.info.rig.rotors; ++c)
      statistics.channels.push_back(
          {.mean_V = kZero_V + (c == 1 || data.info.rig.rotors == 1 ? extra_V : 0) +
                     kGain_V_per_N * force_N * (1 + (force_N > 0 ? normal(0.001) : 0)),
           .std_V = 0.05,
           .standard_error_V = 1e-5,
           .lowest_V = 0.1,
           .highest_V = 3});
    data.raw[run.run] = {.run = run.run, .state = RunState::kComplete, .frames = 1333, .hash = "h"};
    data.statistics[run.run] = statistics;
    data.runs.push_back(run);
  }

  /// The zero of cell 2, in V: `drift` per K of the cell and, from session 7 on, `step`.
  void add_sessions(Tares tares, double drift_V_per_K, double step_V = 0) {
    calibrate_cells();
    for (int session = 0; session < 14; ++session) {
      const double day_C = 24 + normal(2.5);
      const auto add = [&](int minute, RunKind kind, const std::string& place, double force_N) {
        const double cell_C = day_C + normal(1.2);
        add_run(session, minute, kind, place, cell_C,
                drift_V_per_K * (cell_C - 24) + (session >= 7 ? step_V : 0), force_N);
      };
      if (tares != Tares::kNone) add(0, RunKind::kTare, "OT", 0);
      for (int k = 0; k < 12; ++k) {
        const std::string place = k % 3 == 0 ? "OT" : k % 3 == 1 ? "H0V3" : "H4V0";
        add(10 * (k + 1), RunKind::kThrust, place, (k % 3 == 1 ? 4.0 : 7.2) * (1 + normal(0.001)));
      }
      if (tares == Tares::kBothEnds) add(130, RunKind::kTare, "OT", 0);
    }
  }

  Explanation explained(const ObservationChoice& choice = {}) const {
    return test::explained(observe_campaign(data, choice));
  }
  static std::vector<std::string> labels(const Explanation& e) {
    std::vector<std::string> result;
    for (const AdoptedEffect& adopted : e.adopted) result.push_back(adopted.term.label());
    return result;
  }
};

/// What is left of a zero's drift is what the cell has warmed by since the tares.
TEST_F(CampaignMeaning, ADriftOfTheZeroIsHeldAgainstTheTemperatureOfTheTares) {
  constexpr double kDrift = 0.004;
  for (const Tares tares : {Tares::kNone, Tares::kBefore, Tares::kBothEnds}) {
    data.runs.clear();
    add_sessions(tares, kDrift);
    const Explanation e = explained();
    ASSERT_THAT(labels(e), testing::ElementsAre("zero_drift_temperature (cell) of rotor 2"))
        << explanation_text(e);
    EXPECT_NEAR(e.adopted[0].parameters[0].value, kDrift, 0.0003);
    EXPECT_LT(e.after.held_out_rmse, 1.2 * e.noise_floor);
  }
}

/// Between two tares a run's zero was taken at its own place in the order, to the last bit: a step before it
/// has gone with the zero.
TEST_F(CampaignMeaning, AZeroBetweenTwoTaresStandsInTheOrderWhereItsRunDoes) {
  add_sessions(Tares::kBothEnds, 0);
  const Observations o = observe_campaign(data, {});
  const Covariate* order = o.find("run_order");
  ASSERT_NE(order, nullptr);
  ASSERT_GT(order->at_zero.size(), 0);
  for (Index row = 0; row < o.rows(); ++row)
    EXPECT_EQ(order->at_zero(row, 0), static_cast<double>(row)) << o.name[static_cast<std::size_t>(row)];
}

TEST_F(CampaignMeaning, OneLocationHasOneCoefficientHoweverItIsWritten) {
  add_sessions(Tares::kNone, 0);
  int centre = 0;
  for (tunnelrig::Run& run : data.runs)
    if (run.location == "OT" && ++centre % 2 == 0) run.location = "H0V0";
  EXPECT_EQ(observe_campaign(data, {}).groups(), 3);
}

/// The scale under the whole vehicle, a quarter of it to each rotor.
TEST_F(CampaignMeaning, PartsOfATotalAreNoThrustsOfRotors) {
  add_sessions(Tares::kNone, 0.004);
  for (auto& cell : data.certificate->cells) cell = data.certificate->cells[0];
  const auto said = Contains(HasSubstr("each rotor has the same share of the thrust in every run"));
  EXPECT_THAT(observe_campaign(data, {}).left_out, testing::Not(said));
  for (auto& [run, statistics] : data.statistics)
    for (auto& channel : statistics.channels) channel.mean_V = statistics.channels[0].mean_V;
  EXPECT_THAT(observe_campaign(data, {}).left_out, said);
}

/// Hum at 50 Hz where the campaign says 60 is no line of the mains, and would be seen by nothing.
TEST_F(CampaignMeaning, AHumOfTheOtherGridIsSaid) {
  add_sessions(Tares::kNone, 0);
  for (auto& [run, statistics] : data.statistics)
    statistics.channels[0].lines = {{.frequency_hz = 50.02, .amplitude_V = 0.012}};
  const auto said = Contains(HasSubstr("a line at 50 Hz that is no multiple of the shaft's: mains_hz = 60"));
  data.info.daq.mains_hz = 60;
  EXPECT_THAT(observe_campaign(data, {}).left_out, said);
  data.info.daq.mains_hz = 50;
  EXPECT_THAT(observe_campaign(data, {}).left_out, Not(said));
  data.info.daq.mains_hz = 60;
  for (auto& [run, statistics] : data.statistics) statistics.channels[0].lines[0].name = "shaft";
  EXPECT_THAT(observe_campaign(data, {}).left_out, Not(said));
}

/// What changes within a run goes by the clock, whichever frames were lost.
TEST_F(CampaignMeaning, LostFramesAreAPartOfARunsTime) {
  add_sessions(Tares::kNone, 0);
  RunStatistics& lossy = data.statistics.at(data.runs[3].run);
  lossy.window_s = 0.25;
  lossy.window_means_V.assign(lossy.channels.size() * 9, 1);  // the ninth begins after two seconds
  const Observations o = observe_campaign(data, {});
  EXPECT_NEAR(o.duration_s(2), 1, 0.01);
  EXPECT_NEAR(o.duration_s(3), 2, 1e-12);
}

TEST_F(CampaignMeaning, AnAdoptedDriftIsTakenOffByTheTaresTemperature) {
  add_sessions(Tares::kBothEnds, 0.004);
  const Observations o = observe_campaign(data, {});
  const Term drift{
      .effect = &test::effect_named("zero_drift_temperature"), .rotor = 1, .parameters = {0.004}};
  const Eigen::MatrixXd made = respond(drift, o, o.value).value[0];
  const Covariate& cell = *o.find("cell_temperature_C");
  const auto gain = [&](Index row) { return o.newtons_per_volt(1) / o.value(row, 1); };
  for (Index row = 0; row < 12; ++row) {
    const double w = 10.0 * static_cast<double>(row + 1) / 130;  // of the tare behind
    const double then = (1 - w) * data.runs[0].numbers.at("cell_temperature_C") +
                        w * data.runs[13].numbers.at("cell_temperature_C");
    EXPECT_NEAR(made(row, 1), std::log1p(0.004 * gain(row) * (cell.value(row, 0) - then)), 1e-9) << row;
  }
}

TEST_F(CampaignMeaning, AStepOfTheZeroThatTaresTookOffIsNotSought) {
  add_sessions(Tares::kBefore, 0, 0.02);
  const Observations o = observe_campaign(data, {});
  EXPECT_FALSE(CanBeFound(o)(test::effect_named("mounting_step")).ok());
  EXPECT_EQ(explained().verdict, "no_structure");
  data.runs.clear();
  add_sessions(Tares::kNone, 0, 0.02);
  EXPECT_THAT(labels(explained()), Contains(HasSubstr("_step of rotor 2")));
}

TEST_F(CampaignMeaning, ATareWithoutAConditionHasThatOfTheNearestRun) {
  add_sessions(Tares::kBefore, 0.004);
  for (tunnelrig::Run& run : data.runs)
    if (run.kind == RunKind::kTare) run.numbers.erase("cell_temperature_C");
  const Observations o = observe_campaign(data, {});
  EXPECT_THAT(o.left_out, Contains(HasSubstr("cell_temperature_C is empty in 14 of 14 tares")));
  const Covariate& cell = *o.find("cell_temperature_C");
  EXPECT_EQ(cell.at_zero(5, 0), cell.value(0, 0));
}

TEST_F(CampaignMeaning, CellsAreInVoltsAndSoAreTheirZeros) {
  add_sessions(Tares::kNone, 0.004);
  const Explanation e = explained({.response = "cell", .baseline = ""});
  ASSERT_THAT(labels(e), testing::ElementsAre("zero_drift_temperature (cell) of rotor 2"));
  EXPECT_EQ(e.adopted[0].parameters[0].unit, "V/K");
  EXPECT_NEAR(e.adopted[0].parameters[0].value, 0.004, 0.0003);
}

/// Locations of a campaign are no groups of a table, be there one rotor or four.
TEST_F(CampaignMeaning, OneRotorHasNoAmplitudesOfTheLocationsOwn) {
  data.info.rig.rotors = 1;
  add_sessions(Tares::kNone, 0);
  for (tunnelrig::Run& run : data.runs) {
    auto& volts = data.statistics.at(run.run).channels[0].mean_V;
    const double sign = run.location == "OT" ? 1 : run.location == "H0V3" ? -1 : 0.1;
    volts += 0.03 * sign * (run.numbers.at("cell_temperature_C") - 24) / 2.5;
  }
  const Observations o = observe_campaign(data, {});
  const Explanation e = test::explained(o);
  for (const AdoptedEffect& adopted : e.adopted) EXPECT_FALSE(adopted.term.per_group) << explanation_text(e);
  EXPECT_NO_THROW(adopt(o, e, true));
}

/// Numbers that a laboratory gave its runs are no order: a step that was found at a run would begin at
/// another.
TEST_F(CampaignMeaning, WhatIsMadeOfTheTimesIsReadFromNoColumn) {
  add_sessions(Tares::kNone, 0);
  for (tunnelrig::Run& run : data.runs) {
    run.numbers["run_order"] = -run.repeat;
    run.numbers["hours_in_session"] = 42;
    run.labels["hour_of_day"] = "morning";
  }
  const Observations o = observe_campaign(data, {});
  for (const char* name : {"run_order", "hours_in_session", "hour_of_day"})
    EXPECT_EQ(std::ranges::count(o.covariates, name, &Covariate::name), 1) << name;
  for (Index row = 0; row < o.rows(); ++row) {
    EXPECT_EQ(o.find("run_order")->value(row, 0), static_cast<double>(row));
    EXPECT_LT(o.find("hours_in_session")->value(row, 0), 2.1);
  }
}

TEST_F(CampaignMeaning, ThrustsThatCameAsMeansAreOfTheirDuration) {
  add_sessions(Tares::kNone, 0);
  for (tunnelrig::Run& run : data.runs) {
    run.thrust_N = {7, 7.1, 7.2, 7.3};
    if (run.repeat % 2 == 0) run.numbers["duration_s"] = 60;
  }
  data.statistics.clear();
  data.raw.clear();
  const Observations o = observe_campaign(data, {});
  ASSERT_EQ(o.rows(), 168);
  EXPECT_EQ(o.duration_s(0), 60);
  EXPECT_EQ(o.duration_s(1), 0);
  EXPECT_EQ(o.find("duration_s"), nullptr) << "no condition";
}

/// A height above the ground of a place in the tunnel does not put it in the open.
TEST_F(CampaignMeaning, OpenSpaceIsOutsideTheTunnel) {
  add_sessions(Tares::kNone, 0);
  for (tunnelrig::Run& run : data.runs) {
    run.numbers["ground_distance_R"] = 2;
    if (run.location == "OT") {
      run.location = "OS";
    } else {
      run.y_norm = 0.2;
      run.z_norm = 0.4;
    }
  }
  const Observations o = observe_campaign(data, {.response = "", .baseline = "open_space"});
  EXPECT_THAT(o.group_name, testing::UnorderedElementsAre("open space", "H0V3", "H4V0"));
}

}  // namespace
}  // namespace tunnelrig
