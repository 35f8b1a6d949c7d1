#include "flight/simulation/monte_carlo.h"

#include "datasets/error.h"
#include "flight/tuning/cma_es.h"

#include <cmath>
#include <system_error>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>

namespace tunnelrig {
namespace {

struct MonteCarlo : testing::Test {
  Airframe frame;
  FlightSpace space{tunnel_from("1.5"), frame};
  DisturbanceMap map = published_disturbance_map();
  Scenario hover = scenario_from("hover", space, frame);

  MonteCarlo() {
    hover.trajectory = {};
    hover.trajectory.hold(space.middle_m(), 3);
  }

  FlightTask task(int runs, int workers) const {
    return {.space = &space,
            .scenario = &hover,
            .map = &map,
            .believed = frame,
            .runs = runs,
            .workers = workers,
            .seed = 5};
  }
};

void expect_same(const Comparison& a, const Comparison& b) {
  ASSERT_EQ(a.runs.size(), b.runs.size());
  for (std::size_t i = 0; i < a.runs.size(); ++i) {
    EXPECT_EQ(a.runs[i].rms_y_m, b.runs[i].rms_y_m);
    EXPECT_EQ(a.runs[i].largest_z_m, b.runs[i].largest_z_m);
    EXPECT_EQ(a.runs[i].estimator_rms_m, b.runs[i].estimator_rms_m);
  }
  EXPECT_EQ(a.rms_y_m, b.rms_y_m);
  EXPECT_EQ(a.p95_z_m, b.p95_z_m);
}

TEST_F(MonteCarlo, IsTheSameToTheBitWhateverTheNumberOfWorkers) {
  const Comparison one = fly_runs(task(6, 1), "ibs-map", frozen_gains());
  for (const int workers : {1, 2, 5}) expect_same(one, fly_runs(task(6, workers), "ibs-map", frozen_gains()));
}

/// A machine that is full of threads, or a limit on them, must not end the program.
TEST_F(MonteCarlo, FliesWithTheThreadsThatItGets) {
  const Comparison one = fly_runs(task(3, 1), "ibs-map", frozen_gains());
  pthread_attr_t before, without_room;
  ASSERT_EQ(pthread_getattr_default_np(&before), 0);
  ASSERT_EQ(pthread_attr_init(&without_room), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&without_room, std::size_t{1} << 60), 0);
  ASSERT_EQ(pthread_setattr_default_np(&without_room), 0);
  EXPECT_THROW(std::thread([] {}).join(), std::system_error);
  const Comparison alone = fly_runs(task(3, 3), "ibs-map", frozen_gains());
  ASSERT_EQ(pthread_setattr_default_np(&before), 0);
  expect_same(one, alone);
}

TEST_F(MonteCarlo, RunsDifferAndSoDoSeeds) {
  FlightTask given = task(4, 2);
  given.localisation.reset();
  const Comparison one = fly_runs(given, "ibs", frozen_gains());
  EXPECT_NE(one.runs[0].rms_y_m, one.runs[1].rms_y_m);
  given.seed = 6;
  EXPECT_NE(one.runs[0].rms_y_m, fly_runs(given, "ibs", frozen_gains()).runs[0].rms_y_m);
}

TEST_F(MonteCarlo, ALoggedRunIsTheOneOfTheSeries) {
  const Comparison all = fly_runs(task(3, 1), "ibs-do", frozen_gains());
  FlightScore score;
  fly_logged(task(3, 1), "ibs-do", frozen_gains(), 2, &score);
  EXPECT_EQ(score.tracking[0].rms_m(), all.runs[2].rms_y_m);
}

TEST_F(MonteCarlo, TheEstimatorKeepsItsGoalAt40mmOfRangeNoise) {
  FlightTask noisy = task(4, 2);
  noisy.localisation->lidar.range_sigma_m = 0.040;
  const Comparison result = fly_runs(noisy, "ibs-map", frozen_gains());
  EXPECT_LT(result.estimator_rms_m, 0.005);
  EXPECT_EQ(result.contacts, 0);
}

/// Constant errors of attitude and accelerometer, motion within the sweep, latency: the filter knows how well
/// it knows. The thesis's, told nothing of the former two, does not, and errs by more.
TEST_F(MonteCarlo, TheEstimatorIsConsistentInFlight) {
  const Scenario circle = scenario_from("circle", space, frame);
  for (const double sigma_m : {0.010, 0.040}) {
    SCOPED_TRACE(sigma_m);
    FlightTask flight = task(6, 2);
    flight.scenario = &circle;
    flight.localisation->lidar.range_sigma_m = sigma_m;
    const Comparison inertial = fly_runs(flight, "ibs-map", frozen_gains());
    EXPECT_GT(inertial.nees / 4, 0.7);
    EXPECT_LT(inertial.nees / 4, 1.15);
    flight.localisation->filter = FlightFilter::thesis;
    const Comparison thesis = fly_runs(flight, "ibs-map", frozen_gains());
    EXPECT_GT(thesis.nees / 4, 1.2);
    EXPECT_GT(thesis.estimator_rms_m, 1.3 * inertial.estimator_rms_m);
  }
}

TEST_F(MonteCarlo, AFlightThatIsLostHasNoError) {
  FlightTask flight = task(4, 1);
  flight.localisation = {};
  flight.spread.roll_error_rad = 3;  // an attitude that is wrong by this much turns the vehicle over
  const Comparison crashed = fly_runs(flight, "ibs", frozen_gains());
  ASSERT_GT(crashed.lost, 0);
  for (const double error_m : {crashed.rms_y_m, crashed.rms_z_m, crashed.largest_y_m, crashed.largest_z_m,
                               crashed.p95_y_m, crashed.p95_z_m, crashed.ci95_low_m, crashed.ci95_high_m})
    EXPECT_TRUE(std::isinf(error_m)) << error_m;
}

TEST_F(MonteCarlo, OneFlightSaysNothingOfHowFlightsDiffer) {
  const Comparison one = fly_runs(task(1, 1), "ibs", frozen_gains());
  EXPECT_FALSE(one.has_interval());
  EXPECT_EQ(one.ci95_low_m, 0);
  EXPECT_TRUE(std::isinf(one.ci95_high_m));
  EXPECT_TRUE(fly_runs(task(2, 1), "ibs", frozen_gains()).has_interval());
}

/// Runs differ by their vehicles and air, which all controllers share: means of 10 and 10.3 mm over runs that
/// range from 5 to 15 mm have intervals that overlap, though every run says which controller errs more.
TEST(Comparisons, AreMadeRunByRun) {
  Comparison one, other;
  for (int run = 0; run < 20; ++run) {
    const double shared_m = 0.005 + 0.0005 * run, own_m = run % 2 == 0 ? 1e-4 : -1e-4;
    one.runs.push_back({.rms_y_m = shared_m + 0.0003 + own_m});
    other.runs.push_back({.rms_y_m = shared_m});
  }
  const auto more = paired_difference(one, other);
  ASSERT_TRUE(more);
  EXPECT_NEAR(0.5 * (more->low_m + more->high_m), 0.0003, 1e-9);
  EXPECT_NEAR(0.5 * (more->high_m - more->low_m), 2.093 * 1.026e-4 / std::sqrt(20.0), 1e-6);
  other.runs.pop_back();
  EXPECT_FALSE(paired_difference(one, other)) << "not the same runs";
  one.runs = {{.rms_y_m = 1}, {.rms_y_m = 2}, {.rms_y_m = 3}};
  other.runs = {{.rms_y_m = 2}, {.rms_y_m = 2}, {.rms_y_m = 2}};
  const auto few = paired_difference(one, other);
  ASSERT_TRUE(few);
  EXPECT_NEAR(few->high_m, 4.302652730 / std::sqrt(3.0), 1e-7) << "few runs, where t is far from normal";
  one.lost = 1;
  EXPECT_FALSE(paired_difference(one, one));
}

TEST_F(MonteCarlo, UnknownControllersAndTruthsAreRefused) {
  EXPECT_THROW(fly_runs(task(2, 2), "lqr", frozen_gains()), InputError);
  EXPECT_THROW((HiddenTruth{.payload_kg = -1}.validate()), InputError);
  EXPECT_THROW((HiddenTruth{.wind_m_s = NAN}.validate()), InputError);
  EXPECT_THROW((HiddenTruth{.weak_rotor = 5}.validate()), InputError);
  EXPECT_NO_THROW((HiddenTruth{.payload_kg = 0.2, .motor_loss = 0.04}.validate()));
}

TEST(Search, FindsTheLowestPointOfARotatedValley) {
  const auto valley = [](const Eigen::VectorXd& x) {
    const double a = x[0] + x[1] - 1.1, b = x[0] - x[1] - 0.3, c = x[2] - 0.4;
    return 100 * a * a + b * b + 10 * c * c;
  };
  const SearchResult found = minimise(valley, Eigen::VectorXd::Constant(3, 0.5), 0.2, 600, 3);
  EXPECT_EQ(found.evaluations, 600);
  EXPECT_LT(found.cost, 1e-6);
  EXPECT_NEAR(found.best[0], 0.7, 1e-2);
  EXPECT_NEAR(found.best[2], 0.4, 1e-2);
}

}  // namespace
}  // namespace tunnelrig
