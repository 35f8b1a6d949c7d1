// Effects of one name of which none may be seen alone. Two steps of two rotors at one run: what rotors have
// in common scatters less than what they differ by, and says of each of two opposite steps that there is
// none. Crosstalk from several axes: what the one does is scatter for the other.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/scan.h"

#include <cstddef>
#include <optional>

namespace tunnelrig {

/// Adds to the ways of a scan that was not ranked yet: two steps, where they can hide in what rotors differ
/// by from session to session.
void add_pairs_of_steps(const SearchData& data, const NullFit& variances, Scan& scan);

/// Of a table: crosstalk from each two axes, and from all.
void add_several_axes(Scan& scan);

/// The model so far with candidate i of a scan, which is several effects: those that are there beside the
/// others, as its newest terms. Nothing where fewer than two are, where they cannot be told from others of
/// them, or where they do not predict unseen blocks.
std::optional<JointFit> fit_together(const SearchData& data, const Found& found, const Scan& scan,
                                     std::size_t i);

}  // namespace tunnelrig
