// Gains of all controllers by one optimiser, one budget, one cost, one set of flights: none of them those of the comparison.
#pragma once

#include "flight/controllers/any_controller.h"
#include "flight/simulation/monte_carlo.h"

#include <string>

namespace tunnelrig {

struct TuningSettings {
  int evaluations = 300;
  int runs = 2;         // of each training flight; run 0 without, run 1 with drawn errors
  std::uint64_t seed = 20260301;
  int threads = 1;
  LocalisationSettings localisation;
};

struct TunedController {
  std::string name;
  std::map<std::string, double> gains;
  double cost_before = 0, cost = 0;
};

/// Tunes one controller in the hover of the 2.4 m tunnel and the figure of the 1.5 m tunnel, with localisation and the published
/// field, from its struct's defaults, over the logarithms of its gains. The cost is the mean over flights of, in mm,
/// √(rms_y² + rms_z²) + 0.2 · the largest error on either axis, + 2 per newton of effort, + 100 per contact, and 10000 where the
/// vehicle is lost.
TunedController tune(std::string_view name, const TuningSettings& settings);

/// Text of a gain file; `command` is named as what made it.
std::string format_gains(const std::vector<TunedController>& tuned, const TuningSettings& settings,
                         const std::string& command);

}  // namespace tunnelrig
