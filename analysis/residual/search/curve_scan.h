// All curves that may be put on top of the model so far.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/scan.h"

#include <cstddef>

namespace tunnelrig {

/// But for what a found curve describes; beside a named effect of the same covariate without what is
/// straight.
CurveScan scan_curves(const SearchData& data, const Found& found);

/// The bends over an effect's own conditions that no found curve describes.
CurveScan scan_bends(const SearchData& data, const Found& found, const Term& term);

/// Curve `best` of a scan on top of a fit; where that goes with a place, the same everywhere if it predicts
/// about as well.
std::size_t everywhere_instead(const SearchData& data, const JointFit& base, const CurveScan& curves,
                               std::size_t best);

}  // namespace tunnelrig
