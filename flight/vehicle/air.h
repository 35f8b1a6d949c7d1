// What moves in the tunnel's air: wind along it with gusts, and the unsteadiness of the rotors' own
// recirculated flow.
#pragma once

#include "flight/vehicle/random.h"

#include <cmath>

namespace tunnelrig {

/// First-order Gauss-Markov process with this standard deviation and correlation time, stepped exactly.
class GaussMarkov {
 public:
  GaussMarkov() = default;
  GaussMarkov(double deviation, double time_s, double step_s)
      : keep_(std::exp(-step_s / time_s)), drive_(deviation * std::sqrt(1 - keep_ * keep_)), value_(0) {}

  double advance(Random& random) {
    value_ = keep_ * value_ + drive_ * random.normal();
    return value_;
  }
  double value() const { return value_; }

 private:
  double keep_ = 0, drive_ = 0, value_ = 0;
};

struct AirSettings {
  double wind_m_s = 0;    // steady, along the tunnel
  double gust_m_s = 0.2;  // standard deviation; one end of the thesis's tunnels was closed
  double gust_time_s = 2;
  double thrust_unsteadiness = 0.01;  // of every rotor pair's thrust, as a fraction; assumed
  double unsteadiness_time_s = 0.3;
};

}  // namespace tunnelrig
