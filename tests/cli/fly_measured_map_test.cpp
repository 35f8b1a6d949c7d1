// From the rig to flight: the virtual rig measures the field, the chain maps it, and controllers fly in the
// field as it is with the map as it was measured.
#include "cli/program.h"
#include "datasets/csv.h"
#include "flight/scenarios/scenario.h"
#include "flight/simulation/flight_loop.h"
#include "support/temporary_folder.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

struct MeasuredMap : testing::Test {
  test::TemporaryFolder folder;

  test::ProgramResult run(const std::string& arguments) const {
    test::ProgramResult result = test::run_program(folder.path(), arguments);
    EXPECT_EQ(result.code, 0) << arguments << "\n" << result.error;
    return result;
  }

  MeasuredMap() {
    run("plan --out plan.csv --tunnel-only --repeats 2 --duration 1");
    run("log --db c.db --plan plan.csv --source virtual --speed max");
    run("calibrate --db c.db");
    run("map --db c.db --out maps");
  }
};

TEST_F(MeasuredMap, IsFlownAndNamed) {
  const auto result =
      run("fly --map maps/disturbance_map.json --controllers ibs-map,ibs-map-off --runs 4 --json f.json");
  EXPECT_THAT(result.out, testing::Not(testing::HasSubstr("published")));
  const auto flown = nlohmann::json::parse(read_text(folder / "f.json"));
  EXPECT_EQ(flown["map"], "maps/disturbance_map.json");
  const auto &with = flown["controllers"][0], &without = flown["controllers"][1];
  EXPECT_LT(with["rms_y_mm"], without["rms_y_mm"]);
  EXPECT_LT(with["max_y_mm"], 50);
  EXPECT_LT(with["max_z_mm"], 50);
  EXPECT_EQ(with["contacts"], 0);
  const auto other = run("fly --map maps/disturbance_map.json --tunnel 2.4 --controllers ibs --runs 1");
  EXPECT_THAT(other.error, testing::HasSubstr("extrapolated, in normalised coordinates"));
}

TEST_F(MeasuredMap, FliesWhereItsUncertaintyIsNotKnown) {
  auto map = nlohmann::json::parse(read_text(folder / "maps/disturbance_map.json"));
  for (const char* layer : {"delta_ct_u95_percent", "uneven_thrust_u95_percent"})
    for (auto& row : map[layer])
      for (auto& cell : row) cell = nullptr;
  write_text(folder / "unknown.json", map.dump());
  const auto result = run("fly --map unknown.json --controllers ibs --runs 2 --json f.json");
  EXPECT_THAT(result.error, testing::HasSubstr("unknown.json: the map's uncertainty is not known"));
  const auto flown = nlohmann::json::parse(read_text(folder / "f.json"));
  EXPECT_LT(flown["controllers"][0]["max_y_mm"], 50);
}

TEST_F(MeasuredMap, ItsFlightsAreASectionOfTheReport) {
  run("fly --map maps/disturbance_map.json --scenario hover --controllers ibs,pid --runs 2 --out flights");
  const auto flights = nlohmann::json::parse(read_text(folder / "flights/flights.json"));
  EXPECT_EQ(flights["format"], "tunnelrig-flights/1");
  EXPECT_EQ(flights["flights"][0]["controllers"][1]["path"]["y_m"].size(), 300U) << "30 s, ten a second";
  run("report --db c.db --out plain.html");
  run("report --db c.db --out report.html --flights flights/flights.json");
  EXPECT_THAT(read_text(folder / "report.html"), testing::HasSubstr("\"tunnelrig-flights/1\""));
  EXPECT_THAT(read_text(folder / "plain.html"), testing::Not(testing::HasSubstr("\"tunnelrig-flights/1\"")));

  auto broken = flights;
  broken["flights"][0]["controllers"][0].erase("path");
  write_text(folder / "broken.json", broken.dump());
  for (const char* file : {"broken.json", "maps/disturbance_map.json", "plan.csv"}) {
    const auto refused =
        test::run_program(folder.path(), std::string("report --db c.db --out no.html --flights ") + file);
    EXPECT_EQ(refused.code, 2) << file;
    EXPECT_THAT(refused.error, testing::HasSubstr(file));
    EXPECT_FALSE(std::filesystem::exists(folder / "no.html"));
  }
}

TEST_F(MeasuredMap, HalvesWhatTheTrueFieldDoes) {
  const Airframe frame;
  const FlightSpace space(tunnel_from("1.5"), frame);
  const Scenario circle = scenario_from("circle", space, frame);
  const DisturbanceField truth(published_disturbance_map());
  const DisturbanceField measured(read_disturbance_map(folder / "maps/disturbance_map.json"));
  FlightSetup setup;
  setup.map = &measured;
  setup.walls = &space.walls;
  setup.scale = space.scale(frame);
  setup.trajectory = &circle.trajectory;
  setup.air = {.gust_m_s = 0, .thrust_unsteadiness = 0};
  setup.inertial = {.gyro_noise_rad_s = 0, .accelerometer_noise_m_s2 = 0};
  const auto flown = [&](const DisturbanceField* field, const DisturbanceField* map, const char* controller) {
    setup.field = field;
    setup.map = map;
    GivenPosition given;
    AnyController pilot(controller, frozen_gains(), controller_context(setup));
    FlightLog log;
    fly(setup, given, pilot, &log);
    return log;
  };
  const FlightLog undisturbed = flown(nullptr, nullptr, "ibs-map-off");
  const auto induced_m = [&](const DisturbanceField* map, const char* controller) {
    const FlightLog log = flown(&truth, map, controller);
    double sum = 0;
    for (std::size_t i = 0; i < log.rows.size(); ++i)
      sum += std::pow(log.rows[i].position_m[0] - undisturbed.rows[i].position_m[0], 2) +
             std::pow(log.rows[i].position_m[1] - undisturbed.rows[i].position_m[1], 2);
    return std::sqrt(sum / static_cast<double>(log.rows.size()));
  };
  const double without_m = induced_m(&measured, "ibs-map-off"), with_m = induced_m(&measured, "ibs-map");
  RecordProperty("share_left", std::to_string(with_m / without_m));
  EXPECT_LT(with_m, 0.5 * without_m) << 1e3 * with_m << " mm of " << 1e3 * without_m << " mm";
}

}  // namespace
}  // namespace tunnelrig
