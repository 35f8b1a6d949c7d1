// What a condition does times another that is mostly a group's own, or a block's.
#pragma once

#include "analysis/residual/likelihood/joint_fit.h"
#include "analysis/residual/search/search_data.h"

#include <vector>

namespace tunnelrig {

/// Those of `tried` that a product may be found with. Where one of its conditions is mostly constant within
/// each group (or block), the product says that the slopes over the other go with it from group to group.
/// Slopes that differ for reasons of each group's own go with any number that is written beside the groups,
/// as far as rows are counted: here the groups are. A product stays where a regression of the groups' slopes,
/// with a scatter of their own, has p ≤ α over the number of such products.
std::vector<Curve> with_slopes_that_follow(const SearchData& data, const JointFit& fit,
                                           std::vector<Curve> tried);

}  // namespace tunnelrig
