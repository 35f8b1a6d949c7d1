// Effects found come to have amplitudes of each group's own.
#pragma once

#include "analysis/residual/search/search_state.h"

#include <cstddef>

namespace tunnelrig {

/// Effect t, where the data ask for them; it is the newest then. `before_others`: only where no other name
/// does as well for all groups alike.
bool let_groups_differ(SearchState& state, std::size_t t, bool before_others);

/// The first of the effects, the newest first, for which they do. What was found later, and is not beyond
/// chance any more, is dropped.
bool let_any_differ(SearchState& state);

/// One that is new.
bool accept_in_groups(SearchState& state, const Term& way, double p);

}  // namespace tunnelrig
