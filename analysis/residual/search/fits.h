// The model so far with one effect more, or several, or without one.
#pragma once

#include "analysis/residual/search/search_data.h"

#include <cstddef>
#include <vector>

namespace tunnelrig {

/// Of log likelihood, what one parameter brings by chance once in twenty: a ratio test at 5 %.
inline constexpr double kRatioOfOneParameter = 1.92;

/// A joint fit of `base` and one term more, from an amplitude in the effect's unit that is moved into its
/// bounds; theory's coefficient where the data do not speak against it.
JointFit fit_with(const SearchData& data, const JointFit& base, Term term, double amplitude);

/// With all of these, each from its own parameters.
JointFit fit_with_all(const SearchData& data, const JointFit& base, const std::vector<Term>& terms);

/// Without term t.
JointFit fit_without(const SearchData& data, const JointFit& base, std::size_t t);

/// With a curve as its last.
JointFit fit_with_curve(const SearchData& data, const JointFit& base, const Curve& curve);

/// Without curve c.
JointFit fit_without_curve(const SearchData& data, const JointFit& base, std::size_t c);

/// p of a log likelihood ratio (≥ 0) of one parameter of a fitted model: few rows are no large sample.
double ratio_p(const SearchData& data, double ratio, const JointFit& fit);

}  // namespace tunnelrig
