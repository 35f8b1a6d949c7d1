// The loop itself, apart from flight.h so that only its two instantiations compile it.
#pragma once

#include "flight/simulation/flight.h"
#include "flight/simulation/residual_recorder.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

/// The vehicle in its tunnel: everything below the commands to the motors.
class SimulatedVehicle {
 public:
  explicit SimulatedVehicle(const FlightSetup& setup);

  /// One control cycle with these commands.
  void advance(const PerRotor& thrust_N, double time_s, FlightScore& score);

  const RigidState& state() const { return state_; }
  double airspeed_m_s() const { return state_.velocity_m_s[0] - wind_m_s_; }

 private:
  PerRotor rotor_factors(FlightScore& score);
  void meet_walls(double time_s, FlightScore& score);

  const FlightSetup& setup_;
  BodyConstants body_;
  Motors motors_;
  RigidState state_;
  Random air_;
  GaussMarkov gust_, right_, left_;
  double wind_m_s_ = 0;
  double reach_m_;         // from the centre to the vehicle's corners
  double free_way_m_ = 0;  // no wall can be touched before the vehicle has gone so far
  double last_touch_s_ = -1;
};

/// Where the vehicle is turned over or has left for infinity there is nothing more to fly.
inline bool is_lost(const RigidState& state) {
  const double up = thrust_axis(state.attitude)[2];
  const double far = std::abs(state.position_m[1]) + std::abs(state.position_m[2]);
  return !(up > 0) || !(far < 1e3);
}

/// Inertial measurements of the last cycle.
class InertialUnit {
 public:
  InertialUnit(const FlightSetup& setup, const RigidState& state)
      : sensors_(setup.inertial), velocity_(state.velocity_m_s), random_(setup.seed, 4 * setup.stream + 1) {}

  void measure(const RigidState& state) {
    attitude_.angles = euler_angles(state.attitude);
    attitude_.angles.roll_rad += sensors_.roll_error_rad;
    for (std::size_t i = 0; i < 3; ++i)
      attitude_.rate_rad_s[i] = state.rate_rad_s[i] + sensors_.gyro_noise_rad_s * random_.normal();
    Plane force;  // specific force in the world, mean of the cycle
    for (std::size_t i = 0; i < 2; ++i) {
      force[i] = (state.velocity_m_s[i + 1] - velocity_[i + 1]) * kControlRate_Hz +
                 sensors_.accelerometer_noise_m_s2 * random_.normal() + sensors_.accelerometer_bias_m_s2[i];
    }
    force[1] += kGravity_m_s2;
    velocity_ = state.velocity_m_s;
    // The error of the attitude turns what is measured in the body on its way to the world.
    const double e = sensors_.roll_error_rad;
    acceleration_m_s2_ = {force[0] - e * force[1], force[1] + e * force[0] - kGravity_m_s2};
  }

  /// sin φ and cos φ cos θ of the estimated attitude; the heading is near 0 (3.5).
  void tilt(const RigidState& state, ControlInput& in) const {
    const std::array<double, 3> up = thrust_axis(state.attitude);
    in.sin_roll = -up[1] + sensors_.roll_error_rad * up[2];
    in.cos_tilt = up[2] + sensors_.roll_error_rad * up[1];
  }

  const AttitudeSense& attitude() const { return attitude_; }
  const Plane& acceleration_m_s2() const { return acceleration_m_s2_; }

 private:
  InertialSensors sensors_;
  std::array<double, 3> velocity_;
  Random random_;
  AttitudeSense attitude_;
  Plane acceleration_m_s2_{};
};

inline double pilot_pitch(const PilotGains& pilot, const RigidState& state) {
  return std::clamp(-pilot.position_rad_m * state.position_m[0] - pilot.speed_rad_s_m * state.velocity_m_s[0],
                    -pilot.limit_rad, pilot.limit_rad);
}

template <typename Estimator>
FlightScore fly(const FlightSetup& setup, Estimator& estimator, AnyController& controller, FlightLog* log) {
  FlightScore score;
  SimulatedVehicle vehicle(setup);
  InertialUnit inertial(setup, vehicle.state());
  AttitudeLoop attitude(setup.believed, setup.attitude, kControlStep_s);
  ResidualRecorder recorder(setup, log);
  controller.reset();
  estimator.start(vehicle.state());
  const double hover_N = setup.believed.mass_kg * kGravity_m_s2 / kRotors;
  const auto cycles = static_cast<long>(std::ceil(setup.trajectory->duration_s() * kControlRate_Hz));
  double effort = 0;
  long cycle = 0;
  for (; cycle < cycles && !score.lost; ++cycle) {
    const double time_s = static_cast<double>(cycle) * kControlStep_s;
    const RigidState& state = vehicle.state();
    inertial.measure(state);
    const PlanarEstimate estimate =
        estimator.step({time_s, &state, inertial.attitude().angles, inertial.acceleration_m_s2()});
    ControlInput in{.reference = setup.trajectory->at(time_s),
                    .position_m = estimate.position_m,
                    .velocity_m_s = estimate.velocity_m_s,
                    .acceleration_m_s2 = inertial.acceleration_m_s2()};
    inertial.tilt(state, in);
    const ControlOutput out = controller.step(in);
    const PerRotor thrust_N =
        attitude.step({out.roll_rad, pilot_pitch(setup.pilot, state), out.thrust_m_s2, out.roll_moment_N_m},
                      inertial.attitude());
    for (const double t : thrust_N) effort += (t - hover_N) * (t - hover_N);
    if (time_s >= setup.score_from_s) {
      for (std::size_t i = 0; i < 2; ++i) {
        score.tracking[i].add(in.reference.position_m[i] - state.position_m[i + 1]);
        score.estimator[i].add(estimate.position_m[i] - state.position_m[i + 1]);
      }
    }
    if (log != nullptr)
      recorder.cycle(cycle, in, out, attitude.roll_target_rad(), thrust_N, state, inertial.attitude(),
                     vehicle.airspeed_m_s());
    vehicle.advance(thrust_N, time_s, score);
    score.lost = is_lost(vehicle.state());
  }
  score.duration_s = static_cast<double>(cycle) * kControlStep_s;
  score.scored_s = static_cast<double>(score.tracking[0].count()) * kControlStep_s;
  score.effort_N = cycle > 0 ? std::sqrt(effort / (kRotors * static_cast<double>(cycle))) : 0;
  estimator.finish(score);
  return score;
}

}  // namespace tunnelrig
