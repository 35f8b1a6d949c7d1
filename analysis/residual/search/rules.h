// What a candidate beyond chance must not be, to get its name.
#pragma once

#include "analysis/residual/likelihood/cross_validation.h"
#include "analysis/residual/search/found.h"
#include "analysis/residual/search/search_data.h"

#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

/// The rule that keeps a fit's last term out, in words; nothing where none does. `fit`: of what was found and
/// that term; `before` and `after`: leave-one-block-out losses without the term and with it, by the same
/// variances.
std::optional<std::string> why_not(const SearchData& data, const Found& found, const JointFit& fit,
                                   const CrossValidation& before, const CrossValidation& after);

/// Whether it is one of the measured speed, of which the model does not have the square.
bool lacks_speed_squared(const SearchData& data, const Found& found, const Term& term);

/// Whether a course that is straight or bends up to twice over the order of runs does as well as steps on top
/// of a fit, or a bend of the baseline's own law. `with_steps`: losses of the fit with the steps, by these
/// variances.
bool is_gradual(const SearchData& data, const JointFit& base, const std::vector<Term>& steps,
                const NullFit& variances, const CrossValidation& with_steps);

/// What a fit from amplitude `start` makes of an effect that its physical bounds do not hold; nothing where
/// it stays within them.
std::optional<BeyondBounds> beyond_bounds(const SearchData& data, const JointFit& base, Term way,
                                          double start);

}  // namespace tunnelrig
