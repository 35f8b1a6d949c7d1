#include "analysis/residual/search/curve_scan.h"

#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/observations/condition_values.h"
#include "analysis/residual/search/slopes_of_units.h"
#include "analysis/residual/search/unseen.h"

#include <algorithm>

namespace tunnelrig {
namespace {

/// Of the range of speeds, without a run in it.
constexpr double kSpeedsApart = 0.5;

/// Whether what it is over is all but told by what a found one is over: beside each other both could have any
/// size.
bool go_together(const SearchData& data, const Curve& found, const Curve& curve) {
  const bool comparable =
      found.x.cols() == 1 && curve.x.cols() == 1 && found.labels.empty() && curve.labels.empty();
  return comparable && all_but_tells(data.observations(), data.rows(), found.x.col(0), curve.x.col(0));
}

/// Whether a curve over the same covariate and rotor is in, or over one that goes with it.
bool is_described(const SearchData& data, const std::vector<FoundCurve>& curves, const Curve& curve) {
  return std::any_of(curves.begin(), curves.end(), [&](const FoundCurve& found) {
    return (found.curve.covariate == curve.covariate || go_together(data, found.curve, curve)) &&
           found.curve.place.name == curve.place.name &&
           (found.curve.rotor < 0 || found.curve.rotor == curve.rotor);
  });
}

}  // namespace

CurveScan scan_curves(const SearchData& data, const Found& found) {
  CurveScan result;
  for (const Curve& each : data.curves_to_try()) {
    if (is_described(data, found.curves, each)) continue;
    const bool named = std::any_of(found.accepted.begin(), found.accepted.end(), [&](const Accepted& a) {
      if (!each.everywhere() || a.term.rotor != each.rotor || !is_over(each, a.term.effect->covariates))
        return false;
      // What goes with the square of the speed leaves the straight part of a curve over it to be found, but
      // for the difference of a few other speeds from the usual one.
      return !a.term.effect->theory_only ||
             widest_gap(*data.observations().find(each.covariate), data.rows(), each.rotor) > kSpeedsApart;
    });
    // What is straight over few values has a name then, and the bends ask for the rest.
    if (named && each.shape == CurveShape::kLevels) continue;
    Curve curve = named ? without_trend(each, data.rows()) : each;
    if (data.mixed().sees(curve.columns[0])) result.tried.push_back(std::move(curve));
  }
  result.tried = with_slopes_that_follow(data, found.fit, std::move(result.tried));
  for (const Curve& curve : result.tried) result.scan.candidates.push_back(as_candidate(curve));
  if (!result.tried.empty()) rank(data, found.fit, result.scan);
  return result;
}

CurveScan scan_bends(const SearchData& data, const Found& found, const Term& term) {
  CurveScan bends;
  for (const Curve& curve : data.curves_to_try()) {
    if (!is_bend_over(curve, own_conditions(*term.effect, data.observations()), term.rotor) ||
        is_described(data, found.curves, curve))
      continue;
    Curve bend = without_trend(curve, data.rows());
    if (!data.mixed().sees(bend.columns[0])) continue;
    bends.scan.candidates.push_back(as_candidate(bend));
    bends.tried.push_back(std::move(bend));
  }
  if (!bends.tried.empty()) rank(data, found.fit, bends.scan);
  return bends;
}

std::size_t everywhere_instead(const SearchData& data, const JointFit& base, const CurveScan& curves,
                               std::size_t best) {
  const auto& [scan, tried] = curves;
  const Curve& found = tried[best];
  if (found.in_place().empty()) return best;
  const auto errors_with = [&](const Curve& curve) {
    return unseen_with(data, base, columns_with(base, curve.columns), base.variances);
  };
  for (const std::size_t i : scan.order)
    if (tried[i].everywhere() && tried[i].covariate == found.covariate && tried[i].rotor == found.rotor)
      return compare(errors_with(tried[i]), errors_with(found)).told_apart() ? best : i;
  return best;
}

}  // namespace tunnelrig
