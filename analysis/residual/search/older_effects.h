// Effects that give way to another one, or to another form of their own, with a newer effect or a curve in.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/questions.h"

namespace tunnelrig {

/// With a new effect in, an older one may be explained better by another, or not be beyond chance any more.
void ask_older_again(const SearchData& data, Found& found, Questions& questions);

/// Or by another form of itself, which was chosen while the newer was not known: the likelier, where each
/// parameter that a form has more must be worth a ratio test. Whether one was; there may be more.
bool change_a_form(const SearchData& data, Found& found, Questions& questions);

/// Whether an effect is beyond chance among all candidates with the curves in: what was found while their
/// structure was in the residual may have been a part of it. `without`: the fit without it.
bool is_still_found(const SearchData& data, const Found& found, const Term& term, const JointFit& without,
                    Questions& questions);

}  // namespace tunnelrig
