// The loop closed in flight: what a simulated flight's truth has and nobody declared goes from `fly --out`
// through `import` to `explain`, which finds it, names it, and says the error before and after.
#include "cli/program.h"
#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using nlohmann::json;

struct FlightResidual : testing::Test {
  test::TemporaryFolder folder;

  void run(const std::string& arguments) const {
    const test::ProgramResult result = test::run_program(folder.path(), arguments);
    ASSERT_EQ(result.code, 0) << arguments << "\n" << result.error;
  }

  void fly(const std::string& hidden) const {
    run("fly --scenario identification --controllers ibs-map --runs 12 --seed 4 --out f " + hidden);
  }

  json explained(const std::string& response) const {
    run("import f/ibs-map-residual.csv --format table --schema f/residual-" + response + ".toml --db " +
        response + ".db");
    run("explain --db " + response + ".db --baseline linear:time_s --effects f/effects-" + response +
        ".toml --json " + response + ".json");
    return json::parse(read_text(folder / (response + ".json")));
  }
};

double value(const json& effect, const char* parameter) { return effect["parameters"][parameter]["value"]; }

double shrunk_to(const json& explanation) {
  return explanation["after"]["held_out_rmse"].get<double>() /
         explanation["before"]["held_out_rmse"].get<double>();
}

TEST_F(FlightResidual, WhereNothingIsHiddenNothingIsFound) {
  fly("");
  for (const char* response : {"vertical", "roll", "pitch"})
    EXPECT_EQ(explained(response)["verdict"], "no_structure") << response;
}

TEST_F(FlightResidual, APayloadIsFoundAndNoRotorIsToBlame) {
  fly("--payload-kg 0.15");
  const json vertical = explained("vertical");
  ASSERT_EQ(vertical["adopted"].size(), 1U);
  EXPECT_EQ(vertical["adopted"][0]["effect"], "payload");
  // All residuals are negative, so that their size counts; the parameter keeps its own sign.
  EXPECT_NEAR(value(vertical["adopted"][0], "share"), 0.15 / 2.45, 0.015);
  EXPECT_LT(shrunk_to(vertical), 0.9);
  EXPECT_EQ(explained("pitch")["verdict"], "no_structure");
}

TEST_F(FlightResidual, AScaledMapIsFoundOnBothAxes) {
  fly("--map-scale 1.5");
  for (const char* response : {"vertical", "roll"}) {
    const json explanation = explained(response);
    EXPECT_EQ(explanation["verdict"], "explained") << response;
    ASSERT_EQ(explanation["adopted"].size(), 1U) << response;
    EXPECT_EQ(explanation["adopted"][0]["effect"], "field_scale");
    EXPECT_NEAR(value(explanation["adopted"][0], "excess"), 0.5, 0.15) << response;
    EXPECT_LT(shrunk_to(explanation), 0.97) << response;
  }
}

TEST_F(FlightResidual, AGustAlongTheTunnelIsFound) {
  fly("--gust-m-s 2");
  const json vertical = explained("vertical");
  ASSERT_GE(vertical["adopted"].size(), 1U);
  EXPECT_EQ(vertical["adopted"][0]["effect"], "gust_along");
  // The rotors gain 0.0040 s²/m² of their thrust; drag along their tilted axes takes 0.0004 away.
  EXPECT_NEAR(value(vertical["adopted"][0], "gain"), 0.0036, 0.0006);
  EXPECT_LT(shrunk_to(vertical), 0.6);
}

TEST_F(FlightResidual, AMotorThatLostFourPerCentIsFoundByItsNumber) {
  fly("--motor-loss 0.04 --weak-rotor 2");
  const json pitch = explained("pitch");
  ASSERT_GE(pitch["adopted"].size(), 1U);
  EXPECT_EQ(pitch["adopted"][0]["effect"], "weak_rotor_2");
  EXPECT_NEAR(value(pitch["adopted"][0], "loss"), 0.04, 0.002);
  EXPECT_LT(shrunk_to(pitch), 0.2);
}

}  // namespace
}  // namespace tunnelrig
