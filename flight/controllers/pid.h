// The baselines: ArduCopter 4's position cascade (AC_PosControl), and the thesis's single-loop lateral PID
// (6.16) beside ArduCopter's altitude hold. Gains carry ArduCopter's names and scales, lengths in metres
// where it has centimetres.
#pragma once

#include "flight/controllers/controller.h"
#include "flight/vehicle/attitude_loop.h"

#include <vector>

namespace tunnelrig {

struct AltitudeGains {
  double position_p = 1;                          // PSC_POSZ_P, 1/s
  double velocity_p = 5, velocity_filter_Hz = 5;  // PSC_VELZ_P, 1/s; _FLTE
  double acceleration_p = 0.5, acceleration_i = 1,
         acceleration_d = 0;  // PSC_ACCZ_*, thousandths of throttle per cm/s²
  double acceleration_filter_Hz = 20;
  double climb_limit_m_s = 2.5, sink_limit_m_s = 1.5;  // PILOT_SPEED_UP, _DN
  double acceleration_limit_m_s2 = 2.5;                // PILOT_ACCEL_Z
  double integral_limit = 0.3;                         // of the throttle
};

/// Position P (square-root law) → velocity P → acceleration PID on measured acceleration → hover throttle.
class AltitudeCascade {
 public:
  AltitudeCascade(const AltitudeGains& gains, double full_thrust_m_s2, bool feed_forward)
      : gains_(gains), full_thrust_m_s2_(full_thrust_m_s2), feed_forward_(feed_forward) {}

  /// u₁, with the angle boost 1/(cos φ cos θ). `per_step_Hz` is 1/step_s, which its caller needs as well.
  double step(const ControlInput& in, double per_step_Hz);

  void reset() { *this = AltitudeCascade(gains_, full_thrust_m_s2_, feed_forward_); }
  AltitudeGains& gains() { return gains_; }

 private:
  AltitudeGains gains_;
  double full_thrust_m_s2_;
  bool feed_forward_;
  double velocity_error_ = 0, error_ = 0, integral_ = 0;
};

struct LateralGains {
  double position_p = 1;                                    // PSC_POSXY_P, 1/s
  double velocity_p = 2, velocity_i = 1, velocity_d = 0.5;  // PSC_VELXY_*
  double velocity_filter_Hz = 5;                            // _FLTE and _FLTD
  double speed_limit_m_s = 5;                               // WPNAV_SPEED's default
  double acceleration_limit_m_s2 = 2.5;
  double integral_limit_m_s2 = 2;
};

/// ArduCopter's cascade on both axes. With `feed_forward` the reference's velocity is added to the position
/// P's, and its acceleration to the velocity PID's, as AC_PosControl does with its desired velocity and
/// acceleration: the other controllers know the reference's acceleration as well. The thesis's PID has
/// neither.
class PidCascade {
 public:
  PidCascade(const AltitudeGains& altitude, const LateralGains& lateral, double full_thrust_m_s2,
             bool feed_forward)
      : altitude_(altitude, full_thrust_m_s2, feed_forward), lateral_(lateral), feed_forward_(feed_forward) {}

  ControlOutput step(const ControlInput& in);
  void reset();
  std::vector<NamedGain> gain_list();

 private:
  AltitudeCascade altitude_;
  LateralGains lateral_;
  bool feed_forward_;
  OutputLimits limits_;
  double error_ = 0, derivative_ = 0, integral_ = 0;
  bool primed_ = false;
};

struct SinglePidGains {
  double p = 0.25, i = 0.08, d = 0.2;  // rad/m, rad/(m s), rad s/m: K_p, K_i, K_d of (6.16)
  double integral_limit_rad = 0.2;
};

/// The thesis's baseline: lateral (6.16), u_φ a roll angle; vertical ArduCopter's altitude hold without
/// feed-forward.
class PidSingle {
 public:
  PidSingle(const AltitudeGains& altitude, const SinglePidGains& lateral, double full_thrust_m_s2)
      : altitude_(altitude, full_thrust_m_s2, false), lateral_(lateral) {}

  ControlOutput step(const ControlInput& in);
  void reset();
  std::vector<NamedGain> gain_list();

 private:
  AltitudeCascade altitude_;
  SinglePidGains lateral_;
  OutputLimits limits_;
  double integral_rad_ = 0;
};

}  // namespace tunnelrig
