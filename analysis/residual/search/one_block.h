// What all blocks show together, and one of them alone.
#pragma once

#include "analysis/residual/search/search_data.h"

#include <vector>

namespace tunnelrig {

/// The block, as observations number them, without which the evidence of columns on top of a fit falls most,
/// as far as products tell: with the variances, and what is taken out, as they are with it.
int block_missed_most(const SearchData& data, const JointFit& base, const std::vector<Components>& columns);

/// Candidates on top of a fit, by the runs without one block: one bad day whose conditions were special, say.
std::vector<CandidateFit> fits_without(const SearchData& data, const JointFit& base, int block,
                                       const std::vector<Candidate>& candidates);

}  // namespace tunnelrig
