// The estimator in the loop: simulated LIDAR → scan matcher → Kalman filter, with the sweep's duration and
// the matcher's latency.
#pragma once

#include "flight/lidar/simulated_lidar.h"
#include "flight/localisation/kalman_filter.h"
#include "flight/localisation/scan_matcher.h"
#include "flight/scenarios/space.h"
#include "flight/simulation/flight.h"

#include <array>
#include <optional>
#include <variant>

namespace tunnelrig {

enum class FlightFilter {
  inertial,  // InertialFilter, and beams counted from where they were measured
  thesis     // KalmanFilter, and scans taken as of the middle of their sweeps
};

struct LocalisationSettings {
  FlightFilter filter = FlightFilter::inertial;
  LidarSettings lidar;
  int cycles_per_scan = 10;   // 40 Hz
  int cycles_of_latency = 4;  // from the sweep's end to the correction: transfer and matching, 10 ms; assumed
  GateSettings gate;
  /// What the autopilot's calibration leaves: 0.2° of roll, 0.02 m/s².
  StartSettings start = {.bias_sigma_m_s2 = 0.02, .roll_sigma_rad = 0.0035};
  InertialModel inertial;
  /// Not the accelerometer's noise alone: the attitude's error, which this filter does not know of, leaves an
  /// acceleration of g times it, which the filter must be allowed to correct.
  KinematicModel kinematic = {.acceleration_variance_m2_s4 = 0.45};
  double blind_from_s = 0, blind_to_s = 0;  // the LIDAR sees nothing meanwhile
};

/// Positions in the flight frame (z above the floor). `space` must outlive it.
class Localisation {
 public:
  Localisation(const FlightSpace& space, const LocalisationSettings& settings);

  /// For the next flight; what is random in it follows from seed and stream alone.
  void prepare(std::uint64_t seed, std::uint64_t stream);

  void start(const RigidState& truth);
  PlanarEstimate step(const EstimatorInput& in);
  void finish(FlightScore& score) const;

 private:
  static constexpr std::size_t kRemembered = 16;   // cycles of poses, longer than a sweep
  static constexpr std::size_t kPosesOfSweep = 9;  // about one per cycle; odd, so that one is the middle's

  struct Moment {
    LidarPose pose;     // true
    Attitude measured;  // as the autopilot has it
  };

  Moment moment_ago(double ago_s) const;
  void take_scan();
  void correct();
  bool use_scan();
  std::optional<SearchPrior> prior() const;
  MeasuredPosition measured(const Match& match);
  Eigen::Vector4d kinematic_state() const;  // position and velocity
  void judge(const RigidState& truth);

  double floor_m_;
  LocalisationSettings settings_;
  const CrossSection* section_;
  ScanMatcher matcher_;
  std::optional<SimulatedLidar> lidar_;
  std::variant<InertialFilter, KalmanFilter> filter_;
  Scan scan_;
  Attitude scan_attitude_;
  SweepMotion scan_motion_;
  std::array<Moment, kRemembered> moments_;
  long cycle_ = 0;
  bool waiting_ = false;
  int matches_ = 0, rejected_ = 0, rejected_in_a_row_ = 0;
  double nees_sum_ = 0;
  long nees_count_ = 0;
};

}  // namespace tunnelrig
