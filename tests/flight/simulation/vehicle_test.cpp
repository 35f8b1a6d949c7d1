// The vehicle's equations against closed forms.
#include "datasets/error.h"
#include "flight/vehicle/attitude_loop.h"
#include "flight/vehicle/contact.h"
#include "flight/vehicle/motors.h"
#include "flight/vehicle/rigid_body.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

constexpr double kStep_s = 1.0 / 1200;

/// Nothing that dissipates.
Airframe ideal() {
  Airframe frame;
  frame.linear_drag_N_s_m = {0, 0};
  frame.quadratic_drag_N_s2_m2 = 0;
  frame.rate_damping_N_m_s = {0, 0, 0};
  frame.inertia_kg_m2 = {0.02, 0.03, 0.05};
  return frame;
}

TEST(RigidBody, FallsFreely) {
  RigidState state;
  const BodyConstants body(ideal());
  for (int i = 0; i < 1200; ++i) rk4_step(state, body, {}, 0, kStep_s);
  EXPECT_NEAR(state.position_m[2], -0.5 * kGravity_m_s2, 1e-10);
  EXPECT_NEAR(state.velocity_m_s[2], -kGravity_m_s2, 1e-10);
}

TEST(RigidBody, KeepsItsEnergyAndAngularMomentumWhileTumbling) {
  RigidState state;
  state.velocity_m_s = {1, 2, 3};
  state.rate_rad_s = {3, 5, -4};
  const Airframe frame = ideal();
  const BodyConstants body(frame);
  const double before = mechanical_energy_J(state, frame);
  const auto momentum = [&] {
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i) square += std::pow(frame.inertia_kg_m2[i] * state.rate_rad_s[i], 2);
    return std::sqrt(square);
  };
  const double momentum_before = momentum();
  for (int i = 0; i < 2400; ++i) rk4_step(state, body, {}, 0, kStep_s);
  EXPECT_NEAR(mechanical_energy_J(state, frame), before, 1e-7);
  EXPECT_NEAR(momentum(), momentum_before, 1e-9);
  double norm = 0;
  for (const double q : state.attitude) norm += q * q;
  EXPECT_NEAR(norm, 1, 1e-12);
}

TEST(RigidBody, ReachesTheTerminalVelocityOfQuadraticDrag) {
  Airframe frame = ideal();
  frame.quadratic_drag_N_s2_m2 = 0.5;
  RigidState state;
  const BodyConstants body(frame);
  for (int i = 0; i < 24000; ++i) rk4_step(state, body, {}, 0, kStep_s);
  EXPECT_NEAR(state.velocity_m_s[2], -std::sqrt(frame.mass_kg * kGravity_m_s2 / 0.5), 1e-9);
}

TEST(RigidBody, RotationMatrixIsOrthonormalAndAgreesWithTheQuaternion) {
  const EulerAngles angles{0.3, -0.2, 0.7};
  const auto r = rotation_matrix(angles);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k) dot += r[3 * i + k] * r[3 * j + k];
      EXPECT_NEAR(dot, i == j ? 1 : 0, 1e-14);
    }
  }
  const auto q = attitude_from(angles);
  const auto axis = thrust_axis(q);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(axis[i], r[3 * i + 2], 1e-14);
  const EulerAngles back = euler_angles(q);
  EXPECT_NEAR(back.roll_rad, angles.roll_rad, 1e-14);
  EXPECT_NEAR(back.pitch_rad, angles.pitch_rad, 1e-14);
  EXPECT_NEAR(back.yaw_rad, angles.yaw_rad, 1e-14);
}

TEST(RigidBody, ALeaningHoverAcceleratesByGTanPhiToTheLeft) {
  // (3.5): ÿ = −u₁ sin φ, and u₁ cos φ = g keeps the height.
  const Airframe frame = ideal();
  const double roll = 0.1;
  RigidState state;
  state.attitude = attitude_from({roll, 0, 0});
  const RotorLoads loads{frame.mass_kg * kGravity_m_s2 / std::cos(roll), {}};
  const BodyConstants body(frame);
  for (int i = 0; i < 1200; ++i) rk4_step(state, body, {loads, loads, loads}, 0, kStep_s);
  EXPECT_NEAR(state.velocity_m_s[1], -kGravity_m_s2 * std::tan(roll), 1e-10);
  EXPECT_NEAR(state.velocity_m_s[2], 0, 1e-10);
}

TEST(Motors, HoverIsAnEquilibrium) {
  const Airframe frame;
  Motors motors(frame, kStep_s);
  motors.settle(frame.mass_kg * kGravity_m_s2 / kRotors);
  RigidState state;
  const BodyConstants body(frame);
  for (int i = 0; i < 12000; ++i) rk4_step(state, body, motors.advance({1, 1, 1, 1}), 0, kStep_s);
  EXPECT_NEAR(state.position_m[2], 0, 1e-9);
  EXPECT_EQ(state.position_m[1], 0);
}

TEST(Motors, FollowAStepWithTheirLagAndStopAtTheirLimits) {
  const Airframe frame;
  Motors motors(frame, kStep_s);
  motors.settle(2);
  const double from = motors.speed_rad_s()[0];
  EXPECT_FALSE(motors.command({8, 8, 8, 8}));
  const int steps = static_cast<int>(std::lround(frame.motor_lag_s / kStep_s));
  for (int i = 0; i < steps; ++i) motors.advance({1, 1, 1, 1});
  const double to = std::sqrt(8 / frame.thrust_per_speed2_N_s2());
  EXPECT_NEAR(motors.speed_rad_s()[0], to + (from - to) * std::exp(-1.0), 1e-9 * to);
  EXPECT_TRUE(motors.command({100, 8, 8, 8}));
  for (int i = 0; i < 12000; ++i) motors.advance({1, 1, 1, 1});
  EXPECT_NEAR(motors.speed_rad_s()[0], frame.largest_speed_rad_s(), 1e-6);
}

/// docs/campaign-folder.md: 1 front right, 2 rear left, 3 front left, 4 rear right; 1 and 2 turn
/// counter-clockwise.
TEST(Motors, RotorsAreNumberedAsTheRigs) {
  const Airframe frame;
  const auto moment_without = [&](std::size_t weak) {
    Motors motors(frame, kStep_s);
    motors.settle(5);
    PerRotor factor = {1, 1, 1, 1};
    factor[weak - 1] = 0.9;
    return motors.advance(factor)[0].moment_N_m;
  };
  const double lever_N_m = 0.5 * frame.rotor_offset_m(), turn_N_m = 0.5 * frame.torque_over_thrust_m;
  // x towards the viewer, who stands behind the vehicle; y right, z up.
  const auto expect = [&](std::size_t weak, double right, double front, double counter_clockwise) {
    SCOPED_TRACE(weak);
    const auto moment = moment_without(weak);
    EXPECT_NEAR(moment[0], -right * lever_N_m, 1e-12);
    EXPECT_NEAR(moment[1], -front * lever_N_m, 1e-12);
    EXPECT_NEAR(moment[2], counter_clockwise * turn_N_m, 1e-12) << "its torque on the body was the other way";
  };
  expect(1, 1, 1, 1);
  expect(2, -1, -1, 1);
  expect(3, -1, 1, -1);
  expect(4, 1, -1, -1);
}

/// Each axis of the mixer acts on its own axis of the motors, with its sign.
TEST(AttitudeLoop, MixesAsTheMotorsStand) {
  const Airframe frame;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Motors motors(frame, kStep_s);
    motors.settle(5);
    AttitudeSense sense;
    sense.rate_rad_s[axis] = -0.2;  // it is asked to turn the other way
    motors.command(AttitudeLoop(frame, {}, 3 * kStep_s).step({0, 0, kGravity_m_s2, 0}, sense));
    const auto moment = motors.advance({1, 1, 1, 1})[2].moment_N_m;
    EXPECT_GT(moment[axis], 0) << axis;
    EXPECT_NEAR(moment[(axis + 1) % 3], 0, 1e-9);
    EXPECT_NEAR(moment[(axis + 2) % 3], 0, 1e-9);
  }
}

TEST(Motors, ThrustOfTheRigIsItsCoefficient) {
  // (4.18) with one disc as the area: 7.4 N per rotor at 5000 rev/min and C_T 0.1056.
  Airframe frame;
  frame.c_t = 0.1056;
  frame.air_density_kg_m3 = 1.2;
  const double speed = 5000 * 2 * std::numbers::pi / 60;
  EXPECT_NEAR(frame.thrust_per_speed2_N_s2() * speed * speed, 7.4, 0.1);
}

TEST(AttitudeLoop, ReachesACommandedTiltWithLittleOvershoot) {
  const Airframe frame;
  const BodyConstants body(frame);
  Motors motors(frame, kStep_s);
  motors.settle(frame.mass_kg * kGravity_m_s2 / kRotors);
  AttitudeLoop loop(frame, {}, 3 * kStep_s);
  RigidState state;
  double highest = 0;
  for (int i = 0; i < 800; ++i) {
    const EulerAngles angles = euler_angles(state.attitude);
    highest = std::max(highest, angles.roll_rad);
    motors.command(loop.step({0.1, 0, kGravity_m_s2, 0}, {angles, state.rate_rad_s}));
    for (int k = 0; k < 3; ++k) rk4_step(state, body, motors.advance({1, 1, 1, 1}), 0, kStep_s);
  }
  EXPECT_NEAR(euler_angles(state.attitude).roll_rad, 0.1, 0.002);
  EXPECT_LT(highest, 0.115);
}

TEST(Contacts, BounceBackWithTheRestitutionAndLoseNoMoreThanTheyMay) {
  const Walls walls({{-0.75, 0}, {0.75, 0}, {0.75, 1.5}, {-0.75, 1.5}});
  const Airframe frame;
  RigidState state;
  state.position_m = {0, 0.38, 0.75};
  state.velocity_m_s = {0, 0.5, 0};
  const Touch touch = find_touch(walls, frame, 0.38, 0.75, 0, 1);
  ASSERT_GT(touch.depth_m, 0);
  EXPECT_NEAR(touch.normal[0], -1, 1e-12);
  const double before = mechanical_energy_J(state, frame);
  EXPECT_NEAR(resolve_touch(state, frame, touch, {}), 0.5, 1e-12);
  EXPECT_LT(state.velocity_m_s[1], 0);
  EXPECT_LE(mechanical_energy_J(state, frame), before);
  EXPECT_LE(find_touch(walls, frame, state.position_m[1], state.position_m[2], 0, 1).depth_m, 1e-9);
}

TEST(Contacts, ACableTrayIsMetByTheSideOfTheVehicle) {
  // A tray of 50 mm sticks out of the right wall at the vehicle's height; none of the vehicle's own corners
  // is behind a wall.
  const Walls walls(
      {{-0.75, 0}, {0.75, 0}, {0.75, 0.7}, {0.70, 0.7}, {0.70, 0.8}, {0.75, 0.8}, {0.75, 1.5}, {-0.75, 1.5}});
  const Touch touch = find_touch(walls, Airframe{}, 0.34, 0.75, 0, 1);
  EXPECT_GT(touch.depth_m, 0);
  EXPECT_LT(touch.normal[0], -0.9);
  EXPECT_LE(find_touch(walls, Airframe{}, 0.30, 0.75, 0, 1).depth_m, 0);
}

TEST(Airframe, RefusesWhatCannotFly) {
  Airframe frame;
  frame.mass_kg = 7;
  EXPECT_THROW(frame.validate(), InputError);
  frame = {};
  frame.mass_kg = NAN;
  EXPECT_THROW(frame.validate(), InputError);
  EXPECT_NO_THROW(Airframe{}.validate());
}

}  // namespace
}  // namespace tunnelrig
