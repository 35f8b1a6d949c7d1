// The localisation in the loop: simulated LIDAR → Hough scan matcher → Kalman filter, as an estimator of
// flight.h.
#pragma once

#include "flight/lidar/simulated_lidar.h"
#include "flight/localisation/kalman_filter.h"
#include "flight/localisation/scan_matcher.h"
#include "flight/scenarios/space.h"
#include "flight/simulation/flight.h"

namespace tunnelrig {

struct LocalisationSettings {
  LidarSettings lidar;
  double latency_s = 0.0075;  // from the last beam to the correction
  AugmentedModel model;
};

class Localisation {
 public:
  /// `space` must outlive it. The LIDAR's noise belongs to the setup's seed and stream.
  Localisation(const FlightSpace& space, const LocalisationSettings& settings, const FlightSetup& setup);

  void start(const RigidState& truth);
  PlanarEstimate step(const EstimatorInput& in);
  void finish(FlightScore& score) const;

 private:
  /// A match on its way to the filter.
  struct Pending {
    Eigen::Vector2d position_m{0, 0};
    Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
    double taken_s = 0, due_s = 0;
    bool waits = false;
  };

  void scan(const EstimatorInput& in);
  LidarPose pose(const EstimatorInput& in) const;
  SectionPoint in_section(const RigidState& truth) const;

  LocalisationSettings settings_;
  double floor_m_;
  SimulatedLidar lidar_;
  ScanMatcher matcher_;
  AugmentedFilter filter_;
  Pending pending_;
  LidarPose sweep_start_;
  double next_sweep_s_ = 0;  // when its last beam is measured
  bool in_sweep_ = false, first_ = true;
  int matches_ = 0, rejected_ = 0;
  double nees_sum_ = 0;
  long nees_count_ = 0;
};

}  // namespace tunnelrig
