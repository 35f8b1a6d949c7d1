// Campaigns of which a rotor stands still: its thrusts have no logarithm, and the air's density is in the
// baseline of the others all the same.
#include "analysis/residual/explain_program.h"

#include <cmath>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using nlohmann::json;
using test::ExplainProgram;
using test::ProgramResult;
using test::SimulatedRun;
using testing::HasSubstr;
using testing::Not;

struct StandingRotor : ExplainProgram {
  /// Days of very different temperature; rotor 1 reads nothing but noise of both signs.
  void write(double exponent = 0) {
    write_campaign(12, "", [&](SimulatedRun& run) {
      run.air_temperature_C = 10 + 1.3 * (run.session * 5 % 12) + normal(0.3);
      run.thrust_factor = std::pow(run.supply_voltage_V / 16, exponent);
      run.first_rotor_factor = run.number % 2 == 0 ? 0.002 : -0.002;
    });
    import_campaign();
  }
};

TEST_F(StandingRotor, TheDensityIsNoDriftOfTheOthers) {
  write();
  for (const char* response : {"", "--response cell", "--response thrust_1_N", "--response thrust_2_N"}) {
    const json e = explained(response);
    EXPECT_TRUE(e["adopted"].empty()) << response << text;
    EXPECT_LT(e["before"]["held_out_rmse"], 1.6 * e["noise_floor"].get<double>()) << response;
  }
  EXPECT_EQ(explained("--response thrust_2_N")["unit"], "N");
}

TEST_F(StandingRotor, AnEffectOfTheOthersIsFoundAndTakenOff) {
  write(0.7);
  const json e = explained("--adopt --html e.html");
  ASSERT_EQ(e["adopted"].size(), 1u) << text;
  EXPECT_EQ(e["adopted"][0]["effect"], "supply_voltage");
  EXPECT_NEAR(e["adopted"][0]["parameters"]["exponent"]["value"], 0.7, 0.05);
  EXPECT_NE(run("reduce --db c.db").code, 2);
}

TEST_F(StandingRotor, ARotorThatAlwaysReadsTheSameIsSaid) {
  write_campaign(10, "", [](SimulatedRun& run) { run.first_rotor_factor = 0; });
  import_campaign();
  explained();
  EXPECT_THAT(warnings, HasSubstr("thrust of rotor 1 is the same in every run, 0 N"));
  EXPECT_THAT(warnings, Not(HasSubstr("of rotor 2 is the same")));
  const ProgramResult adopted = run("explain --db c.db --simulations 199 --adopt");
  EXPECT_EQ(adopted.code, 2);
  EXPECT_THAT(adopted.error, HasSubstr("--adopt: the response thrust of rotor 1 is the same in every run"));
}

/// Nobody is to make a thrust of what a rotor that has stopped gives.
TEST_F(StandingRotor, ARotorThatStopsIsSaidAndNotCorrected) {
  write_campaign(10, "", [](SimulatedRun& run) {
    if (run.session > 5) run.first_rotor_factor = 0.004;
  });
  import_campaign();
  explained();
  EXPECT_THAT(warnings, HasSubstr("rotor 1 gives next to nothing in"));
  EXPECT_THAT(run("explain --db c.db --adopt").error, HasSubstr("--adopt: rotor 1 gives next to nothing in"));
}

}  // namespace
}  // namespace tunnelrig
