// Named effects: ranked, tried, accepted one by one.
#pragma once

#include "analysis/residual/search/search_state.h"

namespace tunnelrig {

/// As long as one is beyond chance and sound; after each one the older ones are asked again.
void add_effects(SearchState& state);

/// All steps found, where a curve is new that was a part of the scatter when they were placed.
void place_steps(SearchData& data, Found& found);

}  // namespace tunnelrig
