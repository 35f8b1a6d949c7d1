// Many flights of one controller, each with its own noise, vehicle and map errors; the same for a seed
// whatever the number of workers.
#pragma once

#include "flight/scenarios/scenario.h"
#include "flight/simulation/flight.h"
#include "flight/simulation/localisation.h"
#include "flight/simulation/processes.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

/// What the flown truth has and no model knows of.
struct HiddenTruth {
  double payload_kg = 0;
  double map_scale = 1;   // of the field against the map
  double wind_m_s = 0;    // steady, along the tunnel
  double gust_m_s = 0;    // standard deviation along the tunnel, beside the air's own
  double motor_loss = 0;  // share of its thrust that rotor `weak_rotor` (1 to 4) lost
  int weak_rotor = 1;

  /// Throws InputError naming the value and the rule that it breaks.
  void validate() const;
};

/// Standard deviations between runs.
struct Spread {
  double mass = 0.01,
         rotor_thrust = 0.01;  // relative; every rotor its own, after the thesis's sorting of propellers
  double roll_error_rad = 0.0035, accelerometer_bias_m_s2 = 0.02;
  double map_errors = 1;  // of the map's standard uncertainty; a MapError for each layer

  static Spread none() { return {0, 0, 0, 0, 0}; }
};

/// What all controllers of a comparison share.
struct FlightTask {
  const FlightSpace* space = nullptr;
  const Scenario* scenario = nullptr;
  const DisturbanceMap* map = nullptr;  // null: undisturbed air
  Airframe believed;
  HiddenTruth hidden;
  Spread spread;
  AirSettings air;
  std::optional<LocalisationSettings> localisation =
      LocalisationSettings{};  // nothing: the position is given
  int runs = 20;
  int workers = 0;                       // 0: as many as there are cores
  const Processes* processes = nullptr;  // among which the runs are divided; null: this one alone
  std::uint64_t seed = 1;
};

/// One flight. Where it was lost its errors are infinite.
struct RunResult {
  double rms_y_m = 0, rms_z_m = 0, largest_y_m = 0, largest_z_m = 0;
  double estimator_rms_m = 0, nees = 0, effort_N = 0, saturated_s = 0, clamped_s = 0;
  int contacts = 0, matches = 0, rejected_matches = 0;
  bool lost = false;
  std::vector<ContactEvent> touched;

  double rms_m() const;  // √(rms_y² + rms_z²)
};

/// All flights of a controller. Where one was lost the errors are infinite: over all runs there is no bound.
struct Comparison {
  std::string controller;
  std::vector<RunResult> runs;
  double rms_y_m = 0, rms_z_m = 0;  // over all runs
  double largest_y_m = 0, largest_z_m = 0, p95_y_m = 0, p95_z_m = 0;
  // Of the mean of RunResult::rms_m, Student's t; not below 0. Of one run: 0 and infinite.
  double ci95_low_m = 0, ci95_high_m = 0;
  bool has_interval() const { return lost == 0 && runs.size() > 1; }
  int contacts = 0, runs_with_contact = 0, lost = 0;
  std::optional<double> first_contact_s;  // earliest of all runs
  double estimator_rms_m = 0, nees = 0, effort_N = 0;
  double saturated_s = 0, clamped_s = 0;  // mean of a run
  double rejected_share = 0;              // of the matches
};

/// Of a mean over runs, 95 %, Student's t.
struct MeanInterval {
  double low_m = 0, high_m = 0;
};

/// What `one` errs more than `other` in the same run. Of the same task both fly the same vehicles, sensors'
/// errors and air, which drop out here and are most of what Comparison's own intervals consist of. Nothing
/// where a flight was lost, or of a single run.
std::optional<MeanInterval> paired_difference(const Comparison& one, const Comparison& other);

/// `progress` is called from one thread at a time with the number of finished runs (of all processes, as if
/// they were equally fast). With several processes all of them must call this, with the same task; all get
/// the whole result.
Comparison fly_runs(const FlightTask& task, std::string_view controller, const GainTable& gains,
                    const std::function<void(int)>& progress = {});

/// One run of such a series with its log, by its number.
FlightLog fly_logged(const FlightTask& task, std::string_view controller, const GainTable& gains, int run = 0,
                     FlightScore* score = nullptr);

}  // namespace tunnelrig
