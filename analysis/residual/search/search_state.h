// All that changes while a search goes on, and by whom. A step of the search may change what it takes by a
// reference that is not const, and nothing else:
//
//   attribute, structure_left    the order of it all (attribution.cpp)
//   effect_steps, group_steps    effects accepted, each group's amplitudes, the places of steps
//   older_effects                effects swapped and dropped
//   curve_steps                  curves added and smoothed, and effects that give way to them
//
// Whatever else is here reads: scans (effect_scan, curve_scan, together), fits and what they are worth (fits,
// best_run, in_groups, unseen), and what is made of them (rules, curve_work, rivals, detectable,
// scatter_beside). It takes the parts that it reads, and can be asked of any model.
#pragma once

#include "analysis/residual/search/detectable.h"
#include "analysis/residual/search/found.h"
#include "analysis/residual/search/questions.h"
#include "analysis/residual/search/search_data.h"

#include <vector>

namespace tunnelrig {

/// What is reported of the way to the model; nothing is decided by it.
struct SearchRecord {
  JointFit baseline;  // without effects and curves
  std::vector<Round> rounds, curve_rounds;
  std::vector<OfOneBlock> of_one_block;
  Detectable detectable;
};

struct SearchState {
  SearchData data;
  Found found = {};
  Questions questions = Questions();
  SearchRecord record = {};
};

}  // namespace tunnelrig
