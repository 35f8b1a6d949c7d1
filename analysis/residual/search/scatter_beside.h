// What runs scatter like, beside what a search has found so far.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/scan.h"

#include <optional>

namespace tunnelrig {

/// Whether runs, rotors or locations scatter unlike each other, or neighbouring runs resemble each other,
/// beside the model and the best curve, whose own part must not count as scatter: such scatter, where it is
/// another than the observations have. `curves`: all, on top of the model so far.
std::optional<RunScatter> other_scatter_beside(const SearchData& data, const Found& found,
                                               const CurveScan& curves);

/// Whether sessions scatter so much more than runs that it is an unknown of its own; nothing where they do
/// not.
std::optional<SessionScatter> session_scatter_is_large(const SearchData& data, const JointFit& fit);

}  // namespace tunnelrig
