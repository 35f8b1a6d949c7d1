// Effects that do as well as what was found.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/questions.h"

#include <cstddef>
#include <vector>

namespace tunnelrig {

/// One way of each other effect that α would let in in place of effect t and that predicts unseen blocks
/// about as well.
std::vector<Ranked> rivals_of(const SearchData& data, const Found& found, std::size_t t);

/// Those of effect t's `confounded` that these data do not tell from it either.
std::vector<Ranked> still_rivals_of(const SearchData& data, const Found& found, std::size_t t);

/// Effects that step 3 would accept in the place of curve c, and that predict unseen blocks about as well.
/// `without`: the fit without the curve.
std::vector<Term> names_of_curve(const SearchData& data, const Found& found, std::size_t c,
                                 const JointFit& without, Questions& questions);

}  // namespace tunnelrig
