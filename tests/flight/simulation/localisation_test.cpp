// The estimator in the loop where it is wrong or blind.
#include "flight/simulation/localisation.h"

#include "flight/simulation/monte_carlo.h"

#include <cmath>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

/// How far off the estimate is `time_s` after it began wrong by `jump_m` to the left, of a vehicle that
/// stands still.
double error_after_jump_m(const char* tunnel, FlightFilter filter, double jump_m, double time_s) {
  const FlightSpace space(tunnel_from(tunnel), Airframe());
  Localisation localisation(space, {.filter = filter});
  localisation.prepare(1, 0);
  const Plane middle_m = space.middle_m();
  RigidState believed, truth;
  believed.position_m = {0, middle_m[0] - 0.5 * jump_m, middle_m[1]};
  truth.position_m = {0, middle_m[0] + 0.5 * jump_m, middle_m[1]};
  localisation.start(believed);
  PlanarEstimate estimate;
  const int cycles = static_cast<int>(time_s * kControlRate_Hz);
  for (int i = 0; i < cycles; ++i)
    estimate = localisation.step({.time_s = i * kControlStep_s, .truth = &truth});
  return std::hypot(estimate.position_m[0] - truth.position_m[1],
                    estimate.position_m[1] - truth.position_m[2]);
}

/// After a blow or a while without sight. Around a place that is wrong by more than is searched no scan fits,
/// however clearly each of them shows the right one.
TEST(LocalisationInFlight, FindsItselfAgainHoweverFarItIsOff) {
  for (const char* tunnel : {"1.5", "2.4"})
    for (const double jump_m : {0.2, 0.4, 0.6, 0.8, 1.0})
      EXPECT_LT(error_after_jump_m(tunnel, FlightFilter::inertial, jump_m, 2), 0.02)
          << tunnel << ", " << jump_m << " m";
  EXPECT_LT(error_after_jump_m("1.5", FlightFilter::thesis, 0.8, 2), 0.02);
}

TEST(LocalisationInFlight, ComesThroughSecondsWithoutSight) {
  const Airframe frame;
  const FlightSpace space(tunnel_from("1.5"), frame);
  const DisturbanceMap map = published_disturbance_map();
  Scenario hover = scenario_from("hover", space, frame);
  hover.trajectory = {};
  hover.trajectory.hold(space.middle_m(), 8);
  FlightTask task{.space = &space, .scenario = &hover, .map = &map, .believed = frame, .runs = 2, .seed = 5};
  task.localisation->blind_from_s = 2;
  task.localisation->blind_to_s = 4;
  const Comparison blind = fly_runs(task, "ibs-map", frozen_gains());
  EXPECT_NEAR(blind.rejected_share, 0.25, 0.02) << "two seconds of eight";
  EXPECT_EQ(blind.contacts, 0);
  EXPECT_LT(blind.largest_y_m, 0.2);
}

}  // namespace
}  // namespace tunnelrig
