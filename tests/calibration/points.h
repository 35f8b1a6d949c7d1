// Calibration points with a known truth.
#pragma once

#include "datasets/campaign.h"
#include "datasets/error.h"

#include <functional>
#include <random>
#include <string>
#include <vector>

namespace tunnelrig::test {

/// A cell and the noise its points are taken with.
struct SyntheticCell {
  double zero_V = 0.34;
  double gain_V_per_N = 0.242;
  double reading_std_V = 0.003;
  double gauge_std_N = 0;
  double lowest_N = 4.9;
  double highest_N = 9.8;
  int cell = 1;

  double voltage_at(double force_N) const { return zero_V + gain_V_per_N * force_N; }

  /// Points at random forces, on lines 2, 3, … of a file.
  std::vector<CalibrationPoint> points(int count, std::mt19937& engine) const {
    std::uniform_real_distribution<double> force(lowest_N, highest_N);
    std::normal_distribution<double> normal(0, 1);
    std::vector<CalibrationPoint> points;
    for (int i = 0; i < count; ++i) {
      const double applied = force(engine);
      points.push_back({.cell = cell,
                        .applied_force_N = applied + gauge_std_N * normal(engine),
                        .voltage_V = voltage_at(applied) + reading_std_V * normal(engine),
                        .sequence = i + 1,
                        .line = i + 2});
    }
    return points;
  }
};

/// What the call says is wrong with its input.
inline std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no InputError";
}

}  // namespace tunnelrig::test
