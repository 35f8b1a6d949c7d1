// Structure without a name.
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/observations/condition_values.h"
#include "analysis/residual/search/null_maxima.h"
#include "analysis/residual/search/search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

/// A formula that leaves more than this of its own size, rms, as a curve over its own covariate is not what
/// the covariate does. One with a time constant or a length can bend towards the curve, and must do less than
/// it.
constexpr double kMostLeft = 0.3, kMostLeft_bending = 1;

/// A curve over another condition that leaves no more of an effect's variance than this can do all that the
/// effect does.
constexpr double kLittle_other = 0.02;

/// Of the range of speeds, without a run in it.
constexpr double kSpeedsApart = 0.5;

/// Whether it has a time constant or a length that is not at its bound, where a formula is what it is.
bool can_bend(const Term& term) {
  for (std::size_t k = 1; k < term.parameters.size(); ++k)
    if (!is_at_bound(term, k)) return true;
  return false;
}

}  // namespace

void Search::add_curves(const CurveScan& first) {
  bool added = data_.settings().most_curves > 0 && add_best_curve(first);
  while (added) {
    place_steps();
    drop_what_a_curve_replaces();
    add_effects();
    added = static_cast<int>(found_.curves.size()) < data_.settings().most_curves &&
            add_best_curve(scan_curves());
  }
}

Search::CurveScan Search::scan_curves() const {
  CurveScan result;
  for (const Curve& each : data_.curves_to_try()) {
    if (is_described(each)) continue;
    const bool named = std::any_of(found_.accepted.begin(), found_.accepted.end(), [&](const Accepted& a) {
      if (!each.everywhere() || a.term.rotor != each.rotor || !is_over(each, a.term.effect->covariates))
        return false;
      // What goes with the square of the speed leaves the straight part of a curve over it to be found, but
      // for the difference of a few other speeds from the usual one.
      return !a.term.effect->theory_only ||
             widest_gap(*data_.observations().find(each.covariate), data_.rows(), each.rotor) > kSpeedsApart;
    });
    // What is straight over few values has a name then, and the bends ask for the rest.
    if (named && each.shape == CurveShape::kLevels) continue;
    Curve curve = named ? without_trend(each, data_.rows()) : each;
    Candidate candidate = as_candidate(curve);
    if (!data_.mixed().sees(candidate.columns[0])) continue;
    result.scan.candidates.push_back(std::move(candidate));
    result.tried.push_back(std::move(curve));
  }
  if (!result.tried.empty()) rank(found_.fit, result.scan);
  return result;
}

bool Search::add_best_curve(const CurveScan& curves) {
  data_.settings().progress("looking for structure without a name");
  const auto& [scan, tried] = curves;
  if (tried.empty()) return false;
  const std::size_t best = scan.order[0];
  NullMaxima maxima = maxima_of(found_.fit, scan, Draws::kCurves);
  const double p = maxima.p(scan.fits[best].evidence);
  Round round;
  round.observed = scan.fits[best].evidence;
  round.null_maxima = maxima.values();
  round.outcome = fmt::format("p = {:.3g} for {}", p, tried[best].label());
  result_.curve_rounds.push_back(std::move(round));
  if (p > data_.settings().alpha) return false;
  add_curve(tried[everywhere_instead(curves)], p);
  return true;
}

std::size_t Search::everywhere_instead(const CurveScan& curves) const {
  const auto& [scan, tried] = curves;
  const std::size_t best = scan.order[0];
  const Curve& found = tried[best];
  if (found.in_place().empty()) return best;
  const auto errors_with = [&](const Curve& curve) {
    return unseen_with(columns_with(curve.columns), found_.fit.variances);
  };
  for (const std::size_t i : scan.order)
    if (tried[i].everywhere() && tried[i].covariate == found.covariate && tried[i].rotor == found.rotor)
      return compare(errors_with(tried[i]), errors_with(found)).told_apart() ? best : i;
  return best;
}

bool Search::is_described(const Curve& curve) const {
  return std::any_of(found_.curves.begin(), found_.curves.end(), [&](const FoundCurve& found) {
    return (found.curve.covariate == curve.covariate || go_together(found.curve, curve)) &&
           found.curve.place.name == curve.place.name &&
           (found.curve.rotor < 0 || found.curve.rotor == curve.rotor);
  });
}

bool Search::go_together(const Curve& found, const Curve& curve) const {
  constexpr double kLittle = 0.02;  // of its variance
  const bool comparable =
      found.x.cols() == 1 && curve.x.cols() == 1 && found.labels.empty() && curve.labels.empty();
  return comparable && share_beside_cubics(data_.observations(), data_.rows(), {found.x(data_.rows(), 0)},
                                           curve.x(data_.rows(), 0)) < kLittle;
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
    const JointFit without = fit_without(t);
    if (outshone_by_curve(term))
      give_way_to_curve(t, without);
    else if (!product && !is_still_found(term, without)) {
      found_.curves.back().could_be.push_back(term);
      found_.drop(t, without);
    }
  }
}

bool Search::is_still_found(const Term& term, const JointFit& without) {
  const Scan scan = scan_effects(without);
  if (scan.order.empty()) return false;
  return maxima_of(without, scan, Draws::kStillFound).p(evidence_of(scan, term)) <= data_.settings().alpha;
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
  for (FoundCurve& found : found_.curves) {
    std::erase_if(found.could_be, has);
    std::erase_if(found.instead_of, is_named);  // taken again after the curve
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

double Search::share_beside(const Curve& curve, const Term& term, const Eigen::MatrixXd& made,
                            const Eigen::MatrixXd& predicted) const {
  const Eigen::Index channel = std::max(term.rotor, 0), of_curve = curve.x.cols() > 1 ? channel : 0;
  const Eigen::VectorXd column = made(data_.rows(), channel);
  const auto share = [&](const Eigen::VectorXd& of) {
    return share_beside_cubics(data_.observations(), data_.rows(), {curve.x(data_.rows(), of_curve)}, of);
  };
  if (data_.observations().multiplicative) return share(column);
  // What an effect adds goes with the force as well, or with the conditions alone.
  const Eigen::VectorXd of_force = column.cwiseQuotient(predicted(data_.rows(), channel));
  return std::min(share(column), of_force.allFinite() ? share(of_force) : 1.0);
}

bool Search::is_work_of_a_curve(const Term& term, const Eigen::MatrixXd& made,
                                const Eigen::MatrixXd& predicted) const {
  constexpr double kLittle = 0.1;  // of its variance, over a condition of its own
  const auto names = own_conditions(*term.effect, data_.observations());
  return !term.per_group &&
         std::any_of(found_.curves.begin(), found_.curves.end(), [&](const FoundCurve& found) {
           return is_whole_curve_of(found.curve, term) &&
                  share_beside(found.curve, term, made, predicted) <
                      (is_over(found.curve, names) ? kLittle : kLittle_other);
         });
}

bool Search::is_whole_curve_of(const Curve& curve, const Term& term) {
  return curve.everywhere() && !curve.strength && curve.tilt.empty() && curve.rotor == term.rotor &&
         curve.x.size() > 0;
}

bool Search::outshone_by_curve(const Term& term) const {
  const Curve& curve = found_.curves.back().curve;
  const bool over_its_own =
      !curve.tilt.empty() && is_over(curve, own_conditions(*term.effect, data_.observations()));
  if (!over_its_own && !is_whole_curve_of(curve, term)) return false;
  const Eigen::MatrixXd predicted = predict_response(data_.observations(), found_.fit.model, data_.rows());
  const Eigen::MatrixXd made = respond(term, data_.observations(), predicted).value[0];
  // Over a condition that tells the effect's own, a curve may be large only because the two cancel.
  if (!over_its_own && share_beside(curve, term, made, predicted) >= kLittle_other) return false;
  const double most = can_bend(term) ? kMostLeft_bending : kMostLeft;
  return rms_beside_baseline(data_, made_by_newest_curve()) > most * rms_beside_baseline(data_, made);
}

Eigen::MatrixXd Search::made_by_newest_curve() const {
  const auto& columns = found_.fit.model.curves.back().columns;  // the last of the fit
  const Eigen::VectorXd amplitude =
      fit_amplitudes(data_.observations(), difference(data_.y(), found_.fit.linear.offset),
                     found_.fit.linear.columns, found_.fit.variances, data_.rows())
          .amplitude.tail(std::ssize(columns));
  Eigen::MatrixXd made = Eigen::MatrixXd::Zero(data_.observations().rows(), data_.observations().channels());
  for (std::size_t k = 0; k < columns.size(); ++k)
    made += amplitude(static_cast<Eigen::Index>(k)) * columns[k][0];
  return made;
}

bool Search::bends_away(std::size_t t) {
  const Term& term = found_.accepted[t].term;
  if (term.per_group || term.effect->theory_only) return false;
  CurveScan bends;
  for (const Curve& curve : data_.curves_to_try()) {
    if (!is_bend_over(curve, own_conditions(*term.effect, data_.observations()), term.rotor) ||
        is_described(curve))
      continue;
    Curve bend = without_trend(curve, data_.rows());
    if (!data_.mixed().sees(bend.columns[0])) continue;
    bends.scan.candidates.push_back(as_candidate(bend));
    bends.tried.push_back(std::move(bend));
  }
  if (bends.tried.empty()) return false;
  rank(found_.fit, bends.scan);
  const std::size_t best = bends.scan.order[0];
  const double p_allowed = data_.settings().alpha / 2;  // one question of each name, not the largest of many
  SearchSettings enough = data_.settings();             // data sets for such a p
  enough.simulations = std::max(enough.simulations, static_cast<std::size_t>(std::ceil(1 / p_allowed)));
  const double p = maxima_of(found_.fit, bends.scan, Draws::kBends, enough).p(bends.scan.fits[best].evidence);
  if (p > p_allowed) return false;
  const Found before = found_;
  add_curve(bends.tried[best], p);
  const bool bent = outshone_by_curve(found_.accepted[t].term);
  found_ = before;
  return bent;
}

std::optional<SessionScatter> Search::session_scatter_is_large() const {
  constexpr double kOneSided = 0.025;  // a lower bound of 95 %
  const RotorSessions& unlike = data_.observations().scatter.sessions;
  std::optional<SessionScatter> of_rotor;
  for (std::size_t s = 0; s < data_.mixed().strata().size(); ++s) {
    if (!data_.mixed().strata()[s].means()) continue;
    double below = 0;
    for (std::size_t r = 0; r < found_.fit.variances.ratio_probability[s].size(); ++r) {
      if (kRatios[r] <= data_.settings().session_ratio * data_.settings().session_ratio)
        below += found_.fit.variances.ratio_probability[s][r];
    }
    if (below >= kOneSided) continue;
    const Index mode = data_.mixed().strata()[s].first_mode;  // the first is what all have in common
    const bool own = unlike.rotors.size() == 1 && mode > 0 && mode < unlike.alone;
    if (!own) return SessionScatter{-1, below};
    of_rotor = SessionScatter{unlike.rotors[0], below};
  }
  return of_rotor;
}

}  // namespace tunnelrig
