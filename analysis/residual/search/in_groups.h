// An effect whose amplitude is each group's own, tried on top of the model so far.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/search_data.h"

#include <cstddef>
#include <optional>

namespace tunnelrig {

/// A model with such an effect as its last term, and the observations that it speaks of: the term's column is
/// a slope of each group's baseline.
struct InGroups {
  Observations observations;
  JointFit fit;
};

/// Effect t of those found, where the data ask for amplitudes of the groups' own in place of one; nothing
/// where they do not. `before_others`: only where no other name does as well for all groups alike.
std::optional<InGroups> let_differ(const SearchData& data, const Found& found, std::size_t t,
                                   bool before_others);

/// An effect that is nothing on the whole, because groups have it with either sign; nothing where it does not
/// predict unseen blocks better, or another name does as well.
std::optional<InGroups> new_in_groups(const SearchData& data, const Found& found, const Term& way);

/// p of the F-test of amplitudes of the groups' own, which `wider` has as slopes beside those of `fewer`.
double p_of_groups(const SearchData& data, const Observations& fewer, const JointFit& without,
                   const Observations& wider, const JointFit& with);

/// Whether the amplitudes of term t are what physics allows.
bool groups_within_bounds(const SearchData& data, const Observations& wider, const JointFit& fit,
                          std::size_t t);

}  // namespace tunnelrig
