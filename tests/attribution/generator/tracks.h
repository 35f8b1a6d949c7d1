// Which truths a track has, and the design that lets them be told apart, or not.
#pragma once

#include "attribution/generator/design.h"

#include <string_view>

namespace tunnelrig::attribution {

struct Truth {
  std::vector<std::string> effects;
  std::vector<std::string> acceptable;  // names that no run of this campaign can tell from the first effect
  std::vector<std::string> unrecorded;  // columns that are left out of runs.csv
  double sign = 0;                      // of the amplitude, where the design asks for one
  Design design;
};

/// The truth of a track, drawn with `settings.seed`, or `settings.effects` where they are given.
/// Each attempt draws another one. Throws InputError where the track has no such effect.
Truth draw_truth(const Settings& settings, int attempt = 0);

}  // namespace tunnelrig::attribution
