// What all blocks show together, and one of them alone.
#pragma once

#include "analysis/residual/search/search_data.h"

#include <optional>
#include <vector>

namespace tunnelrig {

/// The block, as observations number them, without which the runs say nothing of columns on top of a fit that
/// are beyond chance with it (5 %, as a question of its own): one bad day whose conditions were special, say.
/// Nothing where any one block can be missed, or blocks are single rows, of which a wild one is told by
/// itself.
std::optional<int> block_that_alone_shows(const SearchData& data, const JointFit& base,
                                          const std::vector<Components>& columns);

/// Candidates on top of a fit, by the runs without one block.
std::vector<CandidateFit> fits_without(const SearchData& data, const JointFit& base, int block,
                                       const std::vector<Candidate>& candidates);

}  // namespace tunnelrig
