#include "attribution/generator/weather.h"

#include <numbers>

namespace tunnelrig::attribution {

Course::Course(Random& random, double shortest_s, double longest_s) {
  constexpr int kWaves = 8;
  double power = 0;
  for (int i = 0; i < kWaves; ++i) {
    const double period_s = random.log_uniform(shortest_s, longest_s);
    waves_.push_back({period_s, random.uniform(0, 2 * std::numbers::pi), std::sqrt(period_s)});
    power += period_s / 2;
  }
  for (Wave& wave : waves_) wave.amplitude /= std::sqrt(power);
}

double Course::operator()(double time_s) const {
  double sum = 0;
  for (const Wave& wave : waves_) {
    sum += wave.amplitude * std::sin(2 * std::numbers::pi * time_s / wave.period_s + wave.phase);
  }
  return sum;
}

Weather::Weather(Random& random, bool hot, double pressure_swing_Pa, double warmth_swing_K)
    : fronts_(random, 0.7 * kDay_s, 9 * kDay_s),
      warmth_(random, 1 * kDay_s, 12 * kDay_s),
      moisture_(random, 0.4 * kDay_s, 6 * kDay_s),
      mean_C_(hot ? random.uniform(28, 31) : random.uniform(18, 22)),
      pressure_swing_Pa_(pressure_swing_Pa),
      warmth_swing_K_(warmth_swing_K) {}

Air Weather::at(double time_s, double session_time_h) const {
  const double day = 2 * std::numbers::pi * (std::fmod(time_s, kDay_s) / kDay_s - 15.0 / 24);
  const double outside = warmth_swing_K_ * warmth_(time_s) + 1.2 * std::cos(day);
  const double temperature_C = mean_C_ + outside + 1.5 * -std::expm1(-session_time_h / 1.5);
  const double humidity = 0.5 + 0.11 * moisture_(time_s) - 0.015 * outside;
  return {temperature_C, 101325 + pressure_swing_Pa_ * fronts_(time_s), std::clamp(humidity, 0.08, 0.94)};
}

}  // namespace tunnelrig::attribution
