// The vehicle's equations against closed forms.

#include "datasets/published_field.h"
#include "flight/vehicle/attitude_loop.h"
#include "flight/vehicle/contact.h"
#include "flight/vehicle/disturbance_field.h"
#include "flight/vehicle/motors.h"
#include "flight/vehicle/random.h"
#include "flight/vehicle/rigid_body.h"
#include "support/message_of.h"
#include "support/seeds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

constexpr double kStep_s = 1.0 / 1200;

Airframe without_drag() {
  Airframe frame;
  frame.linear_drag_N_s_m = {0, 0};
  frame.quadratic_drag_N_s2_m2 = 0;
  frame.rate_damping_N_m_s = {0, 0, 0};
  return frame;
}

TEST(RigidBody, FallsAsGalileoSays) {
  const BodyConstants body(without_drag());
  RigidState s;
  s.velocity_m_s = {0.3, -0.2, 1};
  for (int i = 0; i < 1200; ++i) rk4_step(s, body, {}, 0, kStep_s);
  EXPECT_NEAR(s.position_m[0], 0.3, 1e-12);
  EXPECT_NEAR(s.position_m[1], -0.2, 1e-12);
  EXPECT_NEAR(s.position_m[2], 1 - 0.5 * kGravity_m_s2, 1e-11);
}

TEST(RigidBody, ReachesTheTerminalSpeed) {
  Airframe frame = without_drag();
  frame.quadratic_drag_N_s2_m2 = 0.1;
  const BodyConstants body(frame);
  RigidState s;
  for (int i = 0; i < 20 * 1200; ++i) rk4_step(s, body, {}, 0, kStep_s);
  EXPECT_NEAR(s.velocity_m_s[2], -std::sqrt(frame.mass_kg * kGravity_m_s2 / 0.1), 1e-3);
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

TEST(RigidBody, TumblesWithoutLosingEnergyOrMomentum) {
  const Airframe frame = without_drag();
  const BodyConstants body(frame);
  RigidState s;
  s.velocity_m_s = {1, 2, 3};
  s.rate_rad_s = {3, -2, 1};
  const auto momentum = [&](const RigidState& state) {
    const EulerAngles a = euler_angles(state.attitude);
    const auto r = rotation_matrix(a);
    std::array<double, 3> world{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j)
        world[i] += r[3 * i + j] * frame.inertia_kg_m2[j] * state.rate_rad_s[j];
    }
    return world;
  };
  const double energy = mechanical_energy_J(s, frame);
  const auto before = momentum(s);
  for (int i = 0; i < 5 * 1200; ++i) rk4_step(s, body, {}, 0, kStep_s);
  EXPECT_NEAR(mechanical_energy_J(s, frame), energy, 1e-9 * energy);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(momentum(s)[i], before[i], 1e-9);
  double norm = 0;
  for (const double q : s.attitude) norm += q * q;
  EXPECT_NEAR(norm, 1, 1e-12);
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

TEST(RigidBody, RotationMatrixIsOrthonormalAndThrustFollowsIt) {
  const EulerAngles a{0.3, -0.4, 0.7};
  const auto r = rotation_matrix(a);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k) dot += r[3 * k + i] * r[3 * k + j];
      EXPECT_NEAR(dot, i == j ? 1 : 0, 1e-15);
    }
  }
  const auto axis = thrust_axis(attitude_from(a));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(axis[i], r[3 * i + 2], 1e-15);
  const EulerAngles back = euler_angles(attitude_from(a));
  EXPECT_NEAR(back.roll_rad, a.roll_rad, 1e-14);
  EXPECT_NEAR(back.pitch_rad, a.pitch_rad, 1e-14);
  EXPECT_NEAR(back.yaw_rad, a.yaw_rad, 1e-14);
  // The second column as the thesis prints it would not be of unit length.
  const double cr = std::cos(0.3), sr = std::sin(0.3), cp = std::cos(-0.4), sp = std::sin(-0.4),
               cy = std::cos(0.7), sy = std::sin(0.7);
  const double printed =
      std::pow(sr * sp * cy - cp * sy, 2) + std::pow(sr * sp * sy - cp * cy, 2) + sr * sr * cp * cp;
  EXPECT_GT(std::abs(printed - 1), 0.01);
}

TEST(Motors, ThrustIsThatOfTheThrustCoefficient) {
  const Airframe frame;
  // (4.18) at 5000 rev/min with A of one disc
  const double omega = 5000 * 2 * 3.141592653589793 / 60, r = frame.propeller_radius_m;
  const double total = frame.c_t * 0.5 * 1.2 * omega * omega * r * r * 3.141592653589793 * r * r;
  EXPECT_NEAR(4 * frame.thrust_per_speed2_N_s2() * omega * omega, total, 1e-9);
  EXPECT_NEAR(total, 29.9, 0.2);
}

TEST(Motors, SpeedFollowsWithItsLagAndStopsAtItsLimit) {
  const Airframe frame;
  Motors motors(frame, kStep_s);
  motors.settle(4);
  const double from = motors.speed_rad_s()[0];
  EXPECT_FALSE(motors.command({9, 9, 9, 9}));
  const double to = std::sqrt(9 / motors.thrust_per_speed2_N_s2());
  for (int i = 0; i < 48; ++i) motors.advance({1, 1, 1, 1});  // 40 ms, the lag
  EXPECT_NEAR(motors.speed_rad_s()[0], to + (from - to) * std::exp(-1), 1e-9);
  EXPECT_TRUE(motors.command({99, 9, 9, 9}));
  for (int i = 0; i < 1200; ++i) motors.advance({1, 1, 1, 1});
  EXPECT_NEAR(motors.speed_rad_s()[0], frame.largest_speed_rad_s(), 1e-6);
}

TEST(Motors, HoverNeedsAQuarterOfTheWeightEach) {
  const Airframe frame;
  const BodyConstants body(frame);
  Motors motors(frame, kStep_s);
  motors.settle(frame.mass_kg * kGravity_m_s2 / 4);
  RigidState s;
  for (int i = 0; i < 12000; ++i) rk4_step(s, body, motors.advance({1, 1, 1, 1}), 0, kStep_s);
  EXPECT_NEAR(s.position_m[2], 0, 1e-10);
  EXPECT_EQ(s.position_m[1], 0);
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

TEST(AttitudeLoop, ReachesACommandedTiltAndTheVehicleAcceleratesByIt) {
  const Airframe frame = without_drag();
  const BodyConstants body(frame);
  Motors motors(frame, kStep_s);
  motors.settle(frame.mass_kg * kGravity_m_s2 / 4);
  AttitudeLoop loop(frame, {}, 1.0 / 400);
  RigidState s;
  const double roll = 0.1, thrust = kGravity_m_s2 / std::cos(roll);
  double largest = 0, before = 0;
  for (int cycle = 0; cycle < 3 * 400; ++cycle) {
    motors.command(
        loop.step({.roll_rad = roll, .thrust_m_s2 = thrust}, {euler_angles(s.attitude), s.rate_rad_s}));
    before = s.velocity_m_s[1];
    for (int i = 0; i < 3; ++i) rk4_step(s, body, motors.advance({1, 1, 1, 1}), 0, kStep_s);
    largest = std::max(largest, euler_angles(s.attitude).roll_rad);
    if (cycle == 240) EXPECT_NEAR(euler_angles(s.attitude).roll_rad, roll, 0.1 * roll) << "after 0.6 s";
  }
  EXPECT_NEAR(euler_angles(s.attitude).roll_rad, roll, 1e-3);
  EXPECT_LT(largest, 1.1 * roll);
  EXPECT_NEAR((s.velocity_m_s[1] - before) * 400, -kGravity_m_s2 * std::tan(roll), 0.01);  // (3.5)
  EXPECT_NEAR(s.velocity_m_s[2], 0, 0.05);
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

TEST(DisturbanceField, GoesThroughTheNodesAndFollowsTheFieldBetween) {
  const DisturbanceMap map = published_disturbance_map();
  const DisturbanceField field(map);
  for (std::size_t r = 0; r < map.grid.z_norm.size(); ++r) {
    for (std::size_t c = 0; c < map.grid.y_norm.size(); ++c) {
      const Disturbance d = field.at(map.grid.y_norm[c], map.grid.z_norm[r]);
      EXPECT_NEAR(d.thrust_change, 0.01 * map.delta_ct.value_percent[map.grid.index(r, c)], 1e-15);
      EXPECT_NEAR(d.uneven, 0.01 * map.uneven_thrust.value_percent[map.grid.index(r, c)], 1e-15);
    }
  }
  Random random(test::seed());
  for (int i = 0; i < 5000; ++i) {
    const double y = 2 * random.uniform() - 1, z = 2 * random.uniform() - 1;
    EXPECT_NEAR(field.at(y, z).thrust_change, published_thrust_change(y, z), 3e-5) << y << ' ' << z;
    EXPECT_NEAR(field.at(y, z).uneven, published_uneven_thrust(y, z), 3e-4) << y << ' ' << z;
  }
}

TEST(DisturbanceField, IsEvenAndOddToTheLastBitAndSmooth) {
  const DisturbanceField field(published_disturbance_map());
  Random random(test::seed());
  for (int i = 0; i < 5000; ++i) {
    const double y = random.uniform(), z = 2 * random.uniform() - 1;
    EXPECT_EQ(field.at(y, z).thrust_change, field.at(-y, z).thrust_change);
    EXPECT_EQ(field.at(y, z).uneven, -field.at(-y, z).uneven);
  }
  // One-sided slopes agree across nodes.
  constexpr double kH = 1e-6;
  for (double at = -0.95; at < 0.96; at += 0.05) {
    const double up = (field.at(0.3, at + kH).thrust_change - field.at(0.3, at).thrust_change) / kH;
    const double down = (field.at(0.3, at).thrust_change - field.at(0.3, at - kH).thrust_change) / kH;
    EXPECT_NEAR(up, down, 1e-5);
  }
  EXPECT_EQ(field.at(0, 0.4).uneven, 0);
  EXPECT_EQ(field.at(0, 0).thrust_change, 0);
}

TEST(DisturbanceField, HoldsItsBorderOutside) {
  const DisturbanceField field(published_disturbance_map());
  EXPECT_EQ(field.at(1.7, -3).uneven, field.at(1, -1).uneven);
  EXPECT_TRUE(DisturbanceField::outside(1.01, 0));
  EXPECT_TRUE(DisturbanceField::outside(0, -1.01));
  EXPECT_FALSE(DisturbanceField::outside(-1, 1));
  EXPECT_EQ(DisturbanceField().at(0.5, 0.5).thrust_change, 0);
}

TEST(Contact, AFlatBlowBouncesByItsRestitution) {
  const Walls walls({{-1, 0}, {1, 0}, {1, 2}, {-1, 2}});
  const Airframe frame;
  RigidState s;
  s.position_m = {0, 0, 0.149};
  s.velocity_m_s = {0, 0, -0.5};
  const Touch touch = find_touch(walls, frame, 0, 0.149, 0, 1);
  EXPECT_NEAR(touch.depth_m, 0.001, 1e-12);
  EXPECT_NEAR(touch.normal[1], 1, 1e-12);
  // Where the blow goes through the centre there is no rotation in it.
  const double hit = resolve_touch(s, frame, {{0, 0}, {0, 1}, touch.depth_m}, {0.4, 0});
  EXPECT_NEAR(hit, 0.5, 1e-12);
  EXPECT_NEAR(s.velocity_m_s[2], 0.2, 1e-12);
  EXPECT_NEAR(s.position_m[2], 0.15, 1e-12);
  EXPECT_EQ(s.rate_rad_s[0], 0);
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

TEST(Contact, AWallsCornerInsideTheVehicleCounts) {
  // A cable tray that reaches in above the vehicle's corner level: its corner touches the vehicle's side.
  const Walls walls({{-1, 0}, {1, 0}, {1, 0.9}, {0.36, 0.9}, {0.36, 1.1}, {1, 1.1}, {1, 2}, {-1, 2}});
  const Touch touch = find_touch(walls, Airframe{}, 0, 1.0, 0, 1);
  EXPECT_NEAR(touch.depth_m, 0.3717 - 0.36, 1e-9);
  EXPECT_NEAR(touch.normal[0], -1, 1e-12);
}

TEST(Airframe, SaysWhichValueBreaksWhichRule) {
  Airframe frame;
  frame.mass_kg = 8;
  EXPECT_THAT(message_of([&] { frame.validate(); }),
              HasSubstr("largest_thrust_N = 15.7: four of them must exceed"));
  frame = {};
  frame.width_m = 0.3;
  EXPECT_THAT(message_of([&] { frame.validate(); }), HasSubstr("width_m = 0.3"));
  frame = {};
  frame.mass_kg = std::nan("");
  EXPECT_THAT(message_of([&] { frame.validate(); }), HasSubstr("mass_kg"));
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

}  // namespace
}  // namespace tunnelrig
