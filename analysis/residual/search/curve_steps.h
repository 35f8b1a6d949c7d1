// Structure without a name: curves on top of the model, and the names that they replace.
#pragma once

#include "analysis/residual/search/search_state.h"

#include <cstddef>

namespace tunnelrig {

/// As long as one is beyond chance; after each one the effects are searched again. `first`: the curves on top
/// of the model as it is.
void add_curves(SearchState& state, const CurveScan& first);

/// The best one of a scan on top of the model as it is, if it is beyond chance.
bool add_best_curve(SearchState& state, const CurveScan& curves);

/// Waves find structure of any shape, but a straight line in them has bends, and a bend has its middle at
/// that of the range: what they found becomes a smooth curve of as many columns as the data ask for. From
/// curve `first` on.
void smooth_curves(const SearchData& data, Found& found, std::size_t first = 0);

/// Whether a bend over its own covariate is there beside accepted effect t, and has so much of its size that
/// its formula is wrong.
bool bends_away(const SearchData& data, const Found& found, std::size_t t, Questions& questions);

}  // namespace tunnelrig
