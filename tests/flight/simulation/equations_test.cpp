// Closed forms and invariants of the vehicle's equations beside those of vehicle_test.cpp.

#include "flight/vehicle/attitude_loop.h"
#include "flight/vehicle/contact.h"
#include "flight/vehicle/disturbance_field.h"
#include "flight/vehicle/motors.h"
#include "flight/vehicle/quick_angles.h"
#include "flight/vehicle/random.h"
#include "flight/vehicle/rigid_body.h"
#include "support/seeds.h"

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

constexpr double kStep_s = 1.0 / 1200;

Airframe without_drag() {
  Airframe frame;
  frame.linear_drag_N_s_m = {0, 0};
  frame.quadratic_drag_N_s2_m2 = 0;
  frame.rate_damping_N_m_s = {0, 0, 0};
  return frame;
}

TEST(RigidBody, LinearDragDecaysExponentially) {
  Airframe frame = without_drag();
  frame.linear_drag_N_s_m = {0.5, 0.5};
  BodyConstants body(frame);
  body.gravity_m_s2 = 0;
  RigidState s;
  s.velocity_m_s = {1, 2, -3};
  for (int i = 0; i < 1200; ++i) rk4_step(s, body, {}, 0, kStep_s);
  const double left = std::exp(-0.5 / frame.mass_kg);
  EXPECT_NEAR(s.velocity_m_s[0], left, 1e-12);
  EXPECT_NEAR(s.velocity_m_s[2], -3 * left, 1e-12);
}

TEST(RigidBody, ErrorFallsWithTheFourthPowerOfTheStep) {
  const BodyConstants body(without_drag());
  const auto fly = [&](int steps) {
    RigidState s;
    s.rate_rad_s = {8, -6, 4};
    StepLoads loads;
    loads.fill({25, {0.1, -0.2, 0.05}});
    for (int i = 0; i < steps; ++i) rk4_step(s, body, loads, 0, 1.0 / steps);
    return s.position_m[1];
  };
  const double exact = fly(20000);
  const double coarse = std::abs(fly(100) - exact), fine = std::abs(fly(200) - exact);
  EXPECT_GT(coarse / fine, 13);
  EXPECT_LT(coarse / fine, 20);
}

TEST(Motors, MorePushOnTheRightRollsToTheLeft) {
  const Airframe frame;
  const BodyConstants body(frame);
  Motors motors(frame, kStep_s);
  motors.settle(frame.mass_kg * kGravity_m_s2 / 4);
  RigidState s;
  const Disturbance d{.uneven = 0.03};
  for (int i = 0; i < 240; ++i)
    rk4_step(s, body, motors.advance({d.right_factor(), d.left_factor(), d.left_factor(), d.right_factor()}),
             0, kStep_s);
  EXPECT_LT(s.position_m[1], 0);
  EXPECT_GT(euler_angles(s.attitude).roll_rad, 0);
  // M = U ΣT · arm
  const double rate =
      0.03 * frame.mass_kg * kGravity_m_s2 * frame.rotor_offset_m() / frame.inertia_kg_m2[0] * 0.2;
  EXPECT_NEAR(s.rate_rad_s[0], rate, 0.2 * rate);  // less what damping takes
}

TEST(AttitudeLoop, SquareRootLawIsSmoothWhereItBends) {
  const double limit = 2.5, p = 1, bend = limit / (p * p);
  EXPECT_DOUBLE_EQ(square_root_law(bend, p, limit), std::sqrt(2 * limit * (bend - 0.5 * bend)));
  EXPECT_NEAR(square_root_law(bend + 1e-6, p, limit) - square_root_law(bend, p, limit), 1e-6, 1e-11);
  EXPECT_DOUBLE_EQ(square_root_law(-9, p, limit), -square_root_law(9, p, limit));
}

TEST(AttitudeLoop, NoRotorIsAskedForMoreThanItHas) {
  const Airframe frame;
  AttitudeLoop loop(frame, {}, 1.0 / 400);
  Random random(test::seed());
  for (int i = 0; i < 2000; ++i) {
    const PerRotor t = loop.step({random.normal(), random.normal(), 10 + 10 * random.normal(), 0},
                                 {{random.normal(), random.normal(), random.normal()},
                                  {random.normal(), random.normal(), random.normal()}});
    double least = 1e9, most = -1e9;
    for (const double x : t) {
      least = std::min(least, x);
      most = std::max(most, x);
    }
    if (most - least < frame.largest_thrust_N - frame.smallest_thrust_N) {
      EXPECT_LE(most, frame.largest_thrust_N + 1e-9);
      EXPECT_GE(least, frame.smallest_thrust_N - 1e-9);
    }
  }
}

TEST(Contact, NeverAddsEnergy) {
  const Walls walls({{-0.75, 0}, {0.75, 0}, {0.75, 1.5}, {-0.75, 1.5}});
  const Airframe frame;
  Random random(test::seed());
  int touches = 0;
  for (int i = 0; i < 5000; ++i) {
    RigidState s;
    s.position_m = {0, 0.9 * random.uniform() - 0.45, 1.5 * random.uniform()};
    s.velocity_m_s = {0, random.normal(), random.normal()};
    s.rate_rad_s = {random.normal(), 0, 0};
    const double roll = 0.3 * random.normal();
    const Touch touch =
        find_touch(walls, frame, s.position_m[1], s.position_m[2], std::sin(roll), std::cos(roll));
    if (touch.depth_m <= 0) continue;
    ++touches;
    const auto kinetic = [&] {
      return frame.mass_kg * (s.velocity_m_s[1] * s.velocity_m_s[1] + s.velocity_m_s[2] * s.velocity_m_s[2]) +
             frame.inertia_kg_m2[0] * s.rate_rad_s[0] * s.rate_rad_s[0];
    };
    const double before = kinetic();
    resolve_touch(s, frame, touch, {});
    EXPECT_LE(kinetic(), before * (1 + 1e-9));
  }
  EXPECT_GT(touches, 500);
}

TEST(Random, HasTheMomentsOfANormalAndRepeats) {
  Random a(5, 1), b(5, 1), other(5, 2);
  double sum = 0, square = 0, fourth = 0;
  constexpr int kDraws = 400000;
  int beyond = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = a.normal();
    EXPECT_EQ(x, b.normal());
    sum += x;
    square += x * x;
    fourth += x * x * x * x;
    beyond += std::abs(x) > 3 ? 1 : 0;
  }
  EXPECT_NEAR(sum / kDraws, 0, 0.006);
  EXPECT_NEAR(square / kDraws, 1, 0.01);
  EXPECT_NEAR(fourth / kDraws, 3, 0.06);
  EXPECT_NEAR(beyond / double{kDraws}, 0.0027, 0.0004);
  EXPECT_NE(Random(5, 1).bits(), other.bits());
}

TEST(QuickAngles, AgreeWithTheLibraryOnBothSidesOfTheirLimits) {
  for (int i = -1000; i <= 1000; ++i) {
    const double x = 1e-3 * i;
    EXPECT_NEAR(quick_asin(x), std::asin(x), 2e-12) << x;
    EXPECT_NEAR(quick_atan(2 * x), std::atan(2 * x), 1e-13) << x;
    const double angle = 3.14 * x;
    EXPECT_NEAR(quick_atan2(0.7 * std::sin(angle), 0.7 * std::cos(angle)), angle, 1e-13);
  }
  EXPECT_EQ(quick_atan2(0, 0), 0);
  EXPECT_TRUE(std::isnan(quick_atan2(NAN, 1)));
}

}  // namespace
}  // namespace tunnelrig
