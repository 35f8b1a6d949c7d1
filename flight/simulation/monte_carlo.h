// Many flights with errors drawn for each, on several threads. The result depends on the seed alone, not on
// the number of threads or processes.
#pragma once

#include "flight/scenarios/scenario.h"
#include "flight/simulation/flight.h"
#include "flight/simulation/localisation.h"

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

/// Standard deviations of what a run's truth may differ by from what controllers and estimator take it to be.
/// Assumed; no source prints them.
struct Spread {
  double mass = 0.02;             // as a fraction
  double rotor_thrust = 0.01;     // of each rotor, as a fraction
  double map_scale = 0.1;         // of the whole map, as a fraction
  double map_uncertainties = 1;   // of each layer, in its standard uncertainties
  double motor_lag = 0.1;         // as a fraction
  double roll_error_rad = 0.005;  // 0.3°
  double accelerometer_m_s2 = 0.03;
};

/// What the truth holds that nobody has declared (docs/flight.md, "Closing the loop").
struct Undeclared {
  double wind_m_s = 0;  // steady, along the tunnel
  double payload_kg = 0;
  double map_scale = 1;
  int weak_motor = 0;  // 1 to 4, 0 for none
  double weak_motor_loss = 0.04;
};

struct Programme {
  Scenario scenario;
  const FlightSpace* space = nullptr;
  DisturbanceMap map;
  Airframe believed;
  AirSettings air;
  Spread spread;
  Undeclared undeclared;
  LocalisationSettings localisation;
  bool position_given = false;
  std::vector<std::string> controllers;
  GainTable gains;
  double map_share = 1;
  int runs = 1;
  std::uint64_t seed = 1;
  int threads = 1;
  bool keep_logs = false;  // of run 0
};

struct RunResult {
  Plane squares_m2{}, largest_m{}, estimator_squares_m2{};  // mean squares over the scored time
  int contacts = 0;
  std::optional<ContactEvent> first_contact;
  double effort_N = 0, saturated_s = 0, clamped_s = 0, nees = 0;
  int matches = 0, rejected_matches = 0;
  bool lost = false;

  /// √(rms_y² + rms_z²)
  double rms_m() const;
};

struct ControllerResult {
  std::string name;
  std::vector<RunResult> runs;
  std::array<AxisErrors, 2> pooled;    // y, z, all runs
  std::vector<ContactEvent> contacts;  // of run 0
  FlightLog log;                       // of run 0, where kept

  Plane rms_m() const;
  Plane largest_m() const;
  int contacts_of_all() const;
  std::optional<ContactEvent> first_contact() const;  // the earliest of all runs
  double estimator_rms_m() const;                     // √(mean square of y + that of z)
  double mean_of(double RunResult::*value) const;
  int lost_runs() const;

  /// Mean over runs of √(rms_y² + rms_z²) and half the width of its 95 % interval (Student's t); 0 for a
  /// single run.
  std::pair<double, double> rms_with_interval_m() const;
};

using Progress = std::function<void(int done, int total)>;

/// Flies every run with every controller; a run's errors are the same for all controllers. Run 0 has no
/// errors of mass, motors, map and inertial sensors, only noise and gusts; all others have drawn ones. Throws
/// InputError for an unknown controller.
std::vector<ControllerResult> fly_programme(const Programme& programme, const Progress& progress = {});

/// 97.5 % quantile of Student's t.
double student_t_975(int degrees_of_freedom);

}  // namespace tunnelrig
