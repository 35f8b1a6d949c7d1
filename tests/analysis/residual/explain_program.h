// `tunnelrig explain` as a person runs it: simulated campaign folders, and what it answers.
#pragma once

#include "cli/program.h"
#include "datasets/csv.h"
#include "support/example_campaign.h"
#include "support/seeds.h"
#include "support/temporary_folder.h"

#include <array>
#include <functional>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::test {

/// One run of a simulated campaign; `extra` are further cells of runs.csv.
struct SimulatedRun {
  int number = 0, session = 0, hour = 0;  // the latter of the day
  double supply_voltage_V = 16, air_temperature_C = 20;
  double thrust_factor = 1, first_rotor_factor = 1;
  std::string extra;
};

struct ExplainProgram : testing::Test {
  TemporaryFolder folder;
  std::mt19937_64 random{seed()};

  std::function<int(int session)> first_hour = [](int) { return 8; };
  std::array<const char*, 3> locations = {"OT", "H1V1", "H2V0"};  // in turn

  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(random); }

  /// Runs given by their thrusts at three locations; `change` sets what differs.
  void write_campaign(int sessions, const std::string& extra_columns,
                      const std::function<void(SimulatedRun&)>& change) {
    ExampleCampaign campaign;
    campaign.runs_csv =
        "run,location,repeat,session,start_utc,raw,speed_rpm,air_temperature_C,supply_voltage_V" +
        extra_columns + ",thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N\n";
    int number = 0;
    for (int session = 0; session < sessions; ++session) {
      const double offset = normal(0.001);
      for (int i = 0; i < 9; ++i, ++number) {
        SimulatedRun run{.number = number, .session = session, .hour = first_hour(session) + i};
        run.supply_voltage_V = 16 + std::uniform_real_distribution<double>(-0.5, 0.5)(random);
        change(run);
        const double density = 293.15 / (run.air_temperature_C + 273.15);
        campaign.runs_csv +=
            fmt::format("R{:03},{},{},S{:02},2026-03-{:02}T{:02}:00:00Z,,5000,{:.2f},{:.4f}{}", number + 1,
                        locations[static_cast<std::size_t>(i % 3)], number / 3 + 1, session + 1, session + 1,
                        run.hour, run.air_temperature_C, run.supply_voltage_V, run.extra);
        for (int rotor = 0; rotor < 4; ++rotor)
          campaign.runs_csv += fmt::format(",{:.5f}", 7 * density * run.thrust_factor *
                                                          (rotor == 0 ? run.first_rotor_factor : 1) *
                                                          (1 + offset + normal(0.002)));
        campaign.runs_csv += "\n";
      }
    }
    campaign.write(folder / "campaign", 10);
  }

  ProgramResult run(const std::string& arguments) const { return run_program(folder.path(), arguments); }
  void import_campaign() {
    const ProgramResult imported = run("import campaign --db c.db --replace");
    ASSERT_EQ(imported.code, 0) << imported.error;
    ASSERT_NE(run("calibrate --db c.db").code, 2);
  }
  nlohmann::json explained(const std::string& arguments = "") {
    const ProgramResult result = run("explain --db c.db --simulations 199 --json e.json " + arguments);
    EXPECT_EQ(result.code, 0) << result.error;
    warnings = result.error;
    text = result.out;
    return nlohmann::json::parse(read_text(folder / "e.json"));
  }
  static nlohmann::json untestable(const nlohmann::json& explanation, const std::string& effect) {
    for (const nlohmann::json& entry : explanation["untestable"])
      if (entry["effect"] == effect) return entry;
    return nullptr;
  }
  std::string warnings, text;
};

}  // namespace tunnelrig::test
