// What a search has found so far.
#pragma once

#include "analysis/residual/search/attribution.h"

#include <cstddef>
#include <vector>

namespace tunnelrig {

/// A value: a question about another model is asked of a copy. Who changes it does so through the functions
/// below, which keep effects and curves what the fit's terms and curves are, in their order.
struct Found {
  JointFit fit;
  std::vector<Accepted> accepted;           // of each term of the fit
  std::vector<FoundCurve> curves;           // of each of its curves
  std::vector<BeyondBounds> beyond_bounds;  // fitted best, and was refused
  /// Evidence that α asks of an effect: of the last scan whose best is beyond chance, or else of the first.
  double critical = 0;

  /// Another fit of the same effects and curves.
  void set_fit(JointFit other);
  /// The last terms of `with`, which is the fit with them: one, or several that were found together.
  void accept(JointFit with, double p);
  /// `without`: the fit without effect t.
  void drop(std::size_t t, JointFit without);
  /// Effect t comes to be the last; `other`: a fit in which it is, or another one in its place.
  void make_newest(std::size_t t, JointFit other);
  /// `with`: the fit with it as its last curve.
  void add_curve(FoundCurve curve, JointFit with);
  /// Another form of curve c, and the fit with it.
  void set_curve(std::size_t c, const Curve& form, JointFit with);
};

}  // namespace tunnelrig
