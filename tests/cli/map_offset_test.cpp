// `map` says how much U of the rig's own it has found where symmetry demands 0.
#include "cli/program.h"
#include "datasets/csv.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using test::ProgramResult;
using testing::HasSubstr;
using testing::Not;

/// A tunnel without any field; the right pair of rotors is stronger than the left so that U is that.
std::string runs_csv(double u_percent) {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> error(0, 0.002);
  std::string csv =
      "run,location,repeat,session,start_utc,raw,air_temperature_C,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_"
      "N\n";
  int run = 0;
  for (int session = 1; session <= 4; ++session) {
    for (const char* location : {"OT", "H0V2", "H0V-2", "H2V1", "H4V2", "H4V-2", "H5V0"}) {
      std::array<double, 4> thrusts_N{};
      for (std::size_t rotor = 0; rotor < 4; ++rotor) {
        const double side = rotor == 0 || rotor == 3 ? 1 : -1;  // (5.1)
        thrusts_N[rotor] = 7 * (1 + side * u_percent / 100 + error(engine));
      }
      csv += fmt::format("R{0:03},{1},{2},S{2},2026-03-{2:02}T08:{3:02}:00Z,,20.0,{4:.4f}\n", run, location,
                         session, run % 60, fmt::join(thrusts_N, ","));
      ++run;
    }
  }
  return csv;
}

struct MapOffset : testing::Test {
  test::TemporaryFolder folder;

  ProgramResult run(const std::string& arguments) const {
    return test::run_program(folder.path(), arguments);
  }

  void import_with(double u_percent) const {
    std::filesystem::create_directory(folder / "source");
    write_text(folder / "source/campaign.toml",
               "format = \"tunnelrig-campaign/1\"\nname = \"offset\"\n[rig]\npropeller_radius_m = 0.1524\n"
               "nominal_speed_rpm = 5000\nvehicle_width_m = 0.743\nvehicle_height_m = 0.3\n"
               "[tunnel]\nwidth_m = 1.5\nheight_m = 1.5\n");
    write_text(folder / "source/calibration.csv", test::ExampleCampaign().calibration_csv);
    write_text(folder / "source/runs.csv", runs_csv(u_percent));
    const ProgramResult imported = run("import source --db c.db");
    ASSERT_EQ(imported.code, 0) << imported.error;
  }
};

TEST_F(MapOffset, IsSaidWithItsUncertaintyAndIsNotInTheMap) {
  import_with(1);
  const ProgramResult mapped = run("map --db c.db --out maps");
  EXPECT_EQ(mapped.code, 0) << mapped.error;
  EXPECT_THAT(mapped.out, HasSubstr("offset of the rig in U, taken out of the map: "));
  EXPECT_THAT(mapped.error, HasSubstr("is seen where symmetry demands 0"));
  const auto json = nlohmann::json::parse(run("map --db c.db --out maps --json").out)["uneven_thrust"];
  EXPECT_NEAR(json["offset_percent"].get<double>(), 1, json["offset_u95_percent"].get<double>());
  EXPECT_LT(json["offset_u95_percent"].get<double>(), 0.3);
  const Sheet map = read_csv(folder / "maps/uneven_thrust.csv");
  for (std::size_t node = 0; node < map.rows.size(); ++node)
    EXPECT_LE(std::abs(map.require_number(node, "value_percent")), 0.3);
}

TEST_F(MapOffset, ThatIsNotBeyondItsUncertaintyIsNoWarning) {
  import_with(0);
  const ProgramResult mapped = run("map --db c.db --out maps");
  EXPECT_EQ(mapped.code, 0) << mapped.error;
  EXPECT_THAT(mapped.out, HasSubstr("offset of the rig in U, taken out of the map: "));
  EXPECT_THAT(mapped.error, Not(HasSubstr("symmetry demands 0")));
}

}  // namespace
}  // namespace tunnelrig
