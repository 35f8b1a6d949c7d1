// One budget, one optimiser, one cost for all controllers (docs/flight.md).
#pragma once

#include "flight/simulation/monte_carlo.h"

#include <functional>
#include <string>
#include <vector>

namespace tunnelrig {

struct TuningSettings {
  int budget = 1000;  // evaluations per controller; the cascades are not at their end with 300
  int runs = 2;       // flights of either scenario in an evaluation, the same ones in every evaluation
  int workers = 0;
  std::uint64_t seed = 20260301;  // of flights and optimiser; comparisons use others
  double effort_m_per_N = 0.003;  // rms thrust that moves a rotor about its mean counts as so much error
  double contact_m = 0.1;         // so does every contact
};

struct Tuned {
  std::string controller;
  std::map<std::string, double> gains;
  double cost_m = 0, start_cost_m = 0;  // root of the mean of squares
};

/// What tuning minimises, of a controller with given gains, m.
double tuning_cost_m(std::string_view controller, const GainTable& gains, const DisturbanceMap& map,
                     const TuningSettings& settings = {});

/// Searches the logarithms of the controller's gains between their limits, from their defaults.
Tuned tune(std::string_view controller, const DisturbanceMap& map, const TuningSettings& settings,
           const std::function<void(int)>& progress = {});

/// The text of a gain file; `comment` goes in front, its lines beginning with #.
std::string format_gains(const std::vector<Tuned>& tuned, const std::string& comment);

}  // namespace tunnelrig
