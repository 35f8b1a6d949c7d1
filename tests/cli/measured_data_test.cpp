// The documents' examples on measured data (skipped where the data are absent).
#include "cli/program.h"
#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using test::ProgramResult;
using testing::HasSubstr;

struct MeasuredData : testing::Test {
  test::TemporaryFolder folder;
  ProgramResult run(const std::string& arguments) const {
    return test::run_program(folder.path(), arguments);
  }
  static std::string data(const std::string& path) {
    return "'" + (test::shared_data() / path).string() + "'";
  }
};

TEST_F(MeasuredData, StrawsonSweepsGiveCtAgainstSpeed) {
  SKIP_WITHOUT_SHARED_DATA();
  ASSERT_EQ(run("import " + data("strawson_motors/rawdata") +
                " --format rcbenchmark --propeller-diameter-m 0.127 --db s.db")
                .code,
            0);
  const ProgramResult reduced = run("reduce --db s.db --csv s.csv --plot s.png --json");
  ASSERT_EQ(reduced.code, 0) << reduced.error;
  const auto json = nlohmann::json::parse(reduced.out);
  EXPECT_EQ(json["groups"].size(), 208u);
  EXPECT_EQ(json["left_out"]["unknown"], 0);
  EXPECT_GT(json["left_out"]["at_rest"], 100) << "the sweeps begin with the motor at rest";
  std::set<std::string> pulling;
  for (const auto& group : json["groups"]) {
    const double c_t = group["c_t_median"];
    if (c_t < 0) pulling.insert(group["group"]);
    EXPECT_TRUE(std::abs(c_t) > 0.05 && std::abs(c_t) < 0.35)
        << group["group"] << " " << c_t;  // 5-inch propellers of two to four blades
  }
  EXPECT_THAT(pulling, testing::ElementsAre("m7_11.csv", "m7_7.csv", "m8_11.csv", "m8_7.csv"))
      << "measured with the propeller the other way round: kept as measured";
  EXPECT_THAT(read_text(folder / "s.png").substr(1, 3), "PNG");
}

TEST_F(MeasuredData, UiucStaticIsATable) {
  SKIP_WITHOUT_SHARED_DATA();
  write_text(
      folder / "uiuc.toml",
      "format = \"tunnelrig-table/1\"\nname = \"UIUC static\"\ngroups = [\"PropName\"]\nblocks = \"rows\"\n"
      "[response]\ncolumn = \"CT\"\nunit = \"1\"\nmeaning = \"c_t_propeller\"\n"
      "[speed]\ncolumn = \"N\"\nunit = \"rev/min\"\n"
      "[propeller]\ndiameter_column = \"D\"\ndiameter_unit = \"in\"\n");
  ASSERT_EQ(
      run("import " + data("uiuc_static/static.csv") + " --format table --schema uiuc.toml --db u.db").code,
      0);
  const auto json = nlohmann::json::parse(run("reduce --db u.db --json").out);
  EXPECT_EQ(json["observations"], 2763);
}

TEST_F(MeasuredData, FarekeCellsAreCalibratedAndTheGrossRowIsNamed) {
  SKIP_WITHOUT_SHARED_DATA();
  const std::string columns =
      " --forces force_x,force_y,force_z --readings sensor_x,sensor_y,sensor_z --force-unit gf";
  const ProgramResult third = run("calibrate --matrix " + data("fareke_load_cells/cell3.csv") + columns);
  EXPECT_EQ(third.code, 1);
  EXPECT_THAT(third.error, HasSubstr("cell3.csv:8:"));
  EXPECT_NE(run("calibrate --matrix " + data("fareke_load_cells/cell1.csv") + columns).code, 2);
}

TEST_F(MeasuredData, ExampleCampaignOfSomebodyElse) {
  SKIP_WITHOUT_SHARED_DATA();
  const ProgramResult imported = run("import " + data("example_campaign") + " --db e.db");
  ASSERT_EQ(imported.code, 0);
  EXPECT_EQ(imported.error, "");
  const ProgramResult calibrated = run("calibrate --db e.db");
  EXPECT_NE(calibrated.code, 2);
  EXPECT_THAT(calibrated.out, testing::Not(HasSubstr("calibration.csv:")));
  ASSERT_EQ(run("reduce --db e.db --csv e.csv").code, 0);
  EXPECT_EQ(read_csv(folder / "e.csv").rows.size(), 15u);
  EXPECT_EQ(run("map --db e.db --out maps").code, 0);
}

}  // namespace
}  // namespace tunnelrig
