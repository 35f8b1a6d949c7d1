// Several weeks of weather as a laboratory sees it, smooth in time.
#pragma once

#include "attribution/generator/random.h"

namespace tunnelrig::attribution {

inline constexpr double kDay_s = 86400;

/// A smooth random course: waves of periods between two bounds, of variance 1 in all.
class Course {
 public:
  Course(Random& random, double shortest_s, double longest_s);
  double operator()(double time_s) const;

 private:
  struct Wave {
    double period_s, phase, amplitude;
  };
  std::vector<Wave> waves_;
};

struct Air {
  double temperature_C, pressure_Pa, humidity;
};

class Weather {
 public:
  Weather(Random& random, bool hot, double pressure_swing_Pa, double warmth_swing_K);

  /// `session_time_h` since people, lamps and motors began to warm the room.
  Air at(double time_s, double session_time_h) const;

 private:
  Course fronts_, warmth_, moisture_;
  double mean_C_, pressure_swing_Pa_, warmth_swing_K_;
};

}  // namespace tunnelrig::attribution
