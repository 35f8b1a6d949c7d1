// The kinematic Kalman filter of Section 6.1.3, one that also estimates its sensors' constant errors, and one
// that estimates the disturbance beside the accelerometer's bias.
#pragma once

#include "flight/localisation/delayed_filter.h"

namespace tunnelrig {

/// State [y z ẏ ż], m and m/s, world frame, driven by the measured acceleration. F = [[I, Δt I], [0, I]]: the
/// rows printed below (6.11) belong to another ordering of the state.
struct KinematicModel {
  static constexpr int kStates = 4;

  struct Input {
    Eigen::Vector2d acceleration_m_s2{0, 0};  // world frame, gravity taken off
    bool finite() const { return acceleration_m_s2.allFinite(); }
  };

  /// White noise of the acceleration: variance of one sample at rate_hz (Q of the thesis). Longer and shorter
  /// steps get the noise of the same density.
  double acceleration_variance_m2_s4 = 0.0225;
  double rate_hz = 400;

  void step(Belief<kStates>& belief, const Input& input, double dt_s, bool last) const;
};

/// State [y z ẏ ż d_y d_z b_y b_z]: d is the acceleration that a model of the vehicle (thrust, mass,
/// attitude) leaves unexplained, m/s², b the accelerometer's bias. The model drives the prediction, and the
/// accelerometer is a measurement of model + d + b, so that its noise enters once.
struct AugmentedModel {
  static constexpr int kStates = 8;

  struct Input {
    Eigen::Vector2d modelled_m_s2{0, 0};  // world frame, gravity taken off, both
    Eigen::Vector2d measured_m_s2{0, 0};
    bool finite() const { return modelled_m_s2.allFinite() && measured_m_s2.allFinite(); }
  };

  double accelerometer_variance_m2_s4 = 0.0225;  // of one sample, taken at the end of a step
  double acceleration_density_m2_s3 = 1e-6;      // white noise beside d, m²/s⁴ per Hz
  double disturbance_density_m2_s5 = 0.5;        // random walk of d: variance gained per s
  double bias_density_m2_s5 = 1e-6;              // random walk of b

  void step(Belief<kStates>& belief, const Input& input, double dt_s, bool last) const;
};

/// State [y z ẏ ż e b_y b_z]: the kinematic model with the constant errors of its sensors. e is the error of
/// the attitude's roll, rad: it turns what the accelerometer measures on its way to the world, and the scan,
/// which moves the match (MeasuredPosition::per_roll_m); b is the accelerometer's bias in the world's axes,
/// m/s². The acceleration alone shows g e − b_y; how the matches move with the place in the tunnel tells the
/// two apart.
struct InertialModel {
  static constexpr int kStates = 7;
  static constexpr int kRollError = 4;

  using Input = KinematicModel::Input;  // as measured, e and b in it

  double acceleration_variance_m2_s4 = 0.0225;  // white noise of one sample at rate_hz
  double rate_hz = 400;
  double roll_density_rad2_s = 3e-9;  // random walk of e: variance gained per s
  double bias_density_m2_s5 = 1e-7;   // of b

  void step(Belief<kStates>& belief, const Input& input, double dt_s, bool last) const;
};

struct StartSettings {
  double position_sigma_m = 0.05;
  double velocity_sigma_m_s = 0.1;
  double disturbance_sigma_m_s2 = 1;  // AugmentedFilter
  double bias_sigma_m_s2 = 0.1;       // AugmentedFilter, InertialFilter
  double roll_sigma_rad = 0.0035;     // InertialFilter
};

class KalmanFilter : public DelayedFilter<KinematicModel> {
 public:
  explicit KalmanFilter(const Eigen::Vector2d& position_m, const KinematicModel& model = {},
                        const GateSettings& gate = {}, const StartSettings& start = {});

  void predict(const Eigen::Vector2d& acceleration_m_s2, double dt_s) {
    DelayedFilter::predict({acceleration_m_s2}, dt_s);
  }
};

class InertialFilter : public DelayedFilter<InertialModel> {
 public:
  explicit InertialFilter(const Eigen::Vector2d& position_m, const InertialModel& model = {},
                          const GateSettings& gate = {}, const StartSettings& start = {});

  void predict(const Eigen::Vector2d& acceleration_m_s2, double dt_s) {
    DelayedFilter::predict({acceleration_m_s2}, dt_s);
  }

  double roll_error_rad() const { return state()(InertialModel::kRollError); }
  Eigen::Vector2d accelerometer_bias_m_s2() const { return state().tail<2>(); }
};

class AugmentedFilter : public DelayedFilter<AugmentedModel> {
 public:
  explicit AugmentedFilter(const Eigen::Vector2d& position_m, const AugmentedModel& model = {},
                           const GateSettings& gate = {}, const StartSettings& start = {});

  Eigen::Vector2d disturbance_m_s2() const { return state().segment<2>(4); }
  Eigen::Vector2d accelerometer_bias_m_s2() const { return state().segment<2>(6); }
};

}  // namespace tunnelrig
