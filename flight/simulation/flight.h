// One flight in closed loop: estimator, controller and attitude loop at 400 Hz, motors, air and rigid body at
// 1200 Hz. All of it is simulated.
#pragma once

#include "flight/controllers/any_controller.h"
#include "flight/scenarios/trajectory.h"
#include "flight/simulation/flight_log.h"
#include "flight/simulation/score.h"
#include "flight/vehicle/air.h"
#include "flight/vehicle/attitude_loop.h"
#include "flight/vehicle/contact.h"
#include "flight/vehicle/disturbance_field.h"
#include "flight/vehicle/section_scale.h"

#include <cstdint>

namespace tunnelrig {

inline constexpr double kControlRate_Hz = 400;
inline constexpr double kControlStep_s = 1 / kControlRate_Hz;
inline constexpr int kStepsPerCycle = 3;  // of the physics: 1200 Hz
inline constexpr double kPhysicsStep_s = kControlStep_s / kStepsPerCycle;

/// Inertial sensors and the attitude that the autopilot makes of them.
struct InertialSensors {
  double gyro_noise_rad_s = 0.003;
  double accelerometer_noise_m_s2 = 0.15;  // after the autopilot's filters, with vibration
  double roll_error_rad = 0;               // constant error of the attitude estimate
  Plane accelerometer_bias_m_s2{};
};

/// Whoever keeps the vehicle's place along the tunnel: the thesis's pilot, who sees it.
struct PilotGains {
  double position_rad_m = 0.06, speed_rad_s_m = 0.12, limit_rad = 0.14;
};

/// All that a flight needs beside its estimator and controller. Pointers are not owned.
struct FlightSetup {
  Airframe vehicle;                         // as it is
  Airframe believed;                        // as attitude loop and controllers take it to be
  PerRotor rotor_scale = {1, 1, 1, 1};      // thrust over that of the vehicle's constant
  const DisturbanceField* field = nullptr;  // of the walls, as it is
  const DisturbanceField* map = nullptr;    // as measured: for the predictions of the residual log
  const Walls* walls = nullptr;
  SectionScale scale;
  const Trajectory* trajectory = nullptr;
  double score_from_s = 0;
  AirSettings air;
  InertialSensors inertial;
  AttitudeGains attitude;
  PilotGains pilot;
  Bounce bounce;
  std::uint64_t seed = 1, stream = 0;
};

/// What an estimator is given, once per cycle.
struct EstimatorInput {
  double time_s = 0;
  const RigidState* truth = nullptr;  // for simulated sensors only
  EulerAngles attitude;               // as estimated
  Plane acceleration_m_s2{};          // as measured
};

struct PlanarEstimate {
  Plane position_m{}, velocity_m_s{};
};

/// The position given: the estimator of tests and of comparisons without localisation.
struct GivenPosition {
  void start(const RigidState& /*truth*/) {}
  PlanarEstimate step(const EstimatorInput& in) {
    return {{in.truth->position_m[1], in.truth->position_m[2]},
            {in.truth->velocity_m_s[1], in.truth->velocity_m_s[2]}};
  }
  void finish(FlightScore& /*score*/) const {}
};

/// Flies the trajectory to its end. `log`, where given, receives rows; nothing else allocates. The result
/// depends on nothing but the arguments. Instantiated for GivenPosition and Localisation.
template <typename Estimator>
FlightScore fly(const FlightSetup& setup, Estimator& estimator, AnyController& controller,
                FlightLog* log = nullptr);

/// What a controller may know in this flight.
ControllerContext controller_context(const FlightSetup& setup);

}  // namespace tunnelrig
