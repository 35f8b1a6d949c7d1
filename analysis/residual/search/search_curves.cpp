// Structure without a name.
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/observations/condition_values.h"
#include "analysis/residual/search/curve_scan.h"
#include "analysis/residual/search/curve_work.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/rivals.h"
#include "analysis/residual/search/search.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace tunnelrig {

void Search::add_curves(const CurveScan& first) {
  bool added = data_.settings().most_curves > 0 && add_best_curve(first);
  while (added) {
    place_steps();
    drop_what_a_curve_replaces();
    add_effects();
    added = static_cast<int>(found_.curves.size()) < data_.settings().most_curves &&
            add_best_curve(scan_curves(data_, found_));
  }
}

bool Search::add_best_curve(const CurveScan& curves) {
  data_.settings().progress("looking for structure without a name");
  const auto& [scan, tried] = curves;
  if (tried.empty()) return false;
  const std::size_t best = scan.order[0];
  NullMaxima maxima = questions_.maxima_of(data_, found_.fit, scan, Draws::kCurves);
  const double p = maxima.p(scan.fits[best].evidence);
  Round round;
  round.observed = scan.fits[best].evidence;
  round.null_maxima = maxima.values();
  round.outcome = fmt::format("p = {:.3g} for {}", p, tried[best].label());
  result_.curve_rounds.push_back(std::move(round));
  if (p > data_.settings().alpha) return false;
  add_curve(tried[everywhere_instead(data_, found_.fit, curves)], p);
  return true;
}

void Search::add_curve(const Curve& curve, double p) {
  MeanModel model = found_.fit.model;
  model.curves.push_back(curve);
  found_.add_curve({.curve = curve, .p = p, .instead_of = {}},
                   fit_jointly(data_.observations(), model, data_.rows()));
}

void Search::smooth_curves(std::size_t first) {
  for (std::size_t c = first; c < found_.curves.size(); ++c) {
    const std::vector<Curve> forms = smooth_forms(data_.observations(), found_.curves[c].curve, data_.rows());
    if (forms.empty()) continue;
    MeanModel rest = found_.fit.model;
    rest.curves.erase(rest.curves.begin() + static_cast<std::ptrdiff_t>(c));
    const JointFit without = fit_jointly(data_.observations(), rest, data_.rows());
    std::vector<Candidate> candidates;
    for (const Curve& form : forms) candidates.push_back(as_candidate(form));
    const auto fits = CandidateScan(data_.mixed(), without.linear.columns, candidates)
                          .fit(difference(data_.y(), without.linear.offset));
    const Covariate measured =
        as_measured_along(*data_.observations().find(forms[0].covariate), forms.back().shape);
    const double n = places_on_range(measured, data_.rows(), forms[0].rotor);
    const auto criterion = [&](std::size_t i) {   // Hurvich & Tsai 1989
      const auto k = static_cast<double>(i + 2);  // columns and a constant
      return 2 * (k + 1) * n / std::max(n - k - 2, 1.0) - 2 * fits[i].likelihood_ratio;
    };
    std::size_t best = 0;
    for (std::size_t i = 1; i < forms.size(); ++i)
      if (criterion(i) < criterion(best)) best = i;
    MeanModel model = found_.fit.model;
    model.curves[c] = forms[best];
    found_.set_curve(c, forms[best], fit_jointly(data_.observations(), model, data_.rows()));
  }
}

void Search::drop_what_a_curve_replaces() {
  for (std::size_t t = found_.accepted.size(); t-- > 0;) {
    const Term term = found_.accepted[t].term;
    // Those of groups stand in the baseline; that forces go with the square of the speed is not in doubt.
    if (term.per_group || term.effect->theory_only) continue;
    // What two conditions do together is not what one of them does.
    const bool product = found_.curves.back().curve.strength.has_value();
    const JointFit without = fit_without(data_, found_.fit, t);
    if (outshone_by_curve(data_, found_, term))
      give_way_to_curve(t, without);
    else if (!product && !is_still_found(term, without)) {
      found_.curves.back().could_be.push_back(term);
      found_.drop(t, without);
    }
  }
}

void Search::forget_what_has_a_name() {
  const auto has = [&](const Term& term) {
    return std::ranges::any_of(found_.accepted, [&](const Accepted& accepted) {
      return share_a_condition(*accepted.term.effect, *term.effect, data_.observations());
    });
  };
  const auto is_named = [&](const std::string& name) {
    return std::ranges::any_of(found_.accepted,
                               [&](const Accepted& accepted) { return accepted.term.effect->name == name; });
  };
  for (FoundCurve& curve : found_.curves) {
    std::erase_if(curve.could_be, has);
    std::erase_if(curve.instead_of, is_named);  // taken again after the curve
  }
}

void Search::give_way_to_curve(std::size_t t, const JointFit& without) {
  FoundCurve& newest = found_.curves.back();
  newest.instead_of.push_back(found_.accepted[t].term.effect->name);
  found_.drop(t, without);
  MeanModel model = found_.fit.model;
  model.curves.back() = with_trend(newest.curve);
  const Curve& straight_too = model.curves.back();
  found_.set_curve(found_.curves.size() - 1, straight_too,
                   fit_jointly(data_.observations(), model, data_.rows()));
}

bool Search::bends_away(std::size_t t) {
  const Term& term = found_.accepted[t].term;
  if (term.per_group || term.effect->theory_only) return false;
  const CurveScan bends = scan_bends(data_, found_, term);
  if (bends.tried.empty()) return false;
  const std::size_t best = bends.scan.order[0];
  const double p_allowed = data_.settings().alpha / 2;  // one question of each name, not the largest of many
  SearchSettings enough = data_.settings();             // data sets for such a p
  enough.simulations = std::max(enough.simulations, static_cast<std::size_t>(std::ceil(1 / p_allowed)));
  const double p = questions_.maxima_of(data_, found_.fit, bends.scan, Draws::kBends, enough)
                       .p(bends.scan.fits[best].evidence);
  if (p > p_allowed) return false;
  const Found before = found_;
  add_curve(bends.tried[best], p);
  const bool bent = outshone_by_curve(data_, found_, found_.accepted[t].term);
  found_ = before;
  return bent;
}

void Search::name_newest_curve(const JointFit& without) {
  found_.curves.back().could_be = names_of_newest_curve(data_, found_, without, questions_);
}

}  // namespace tunnelrig
