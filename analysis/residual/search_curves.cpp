// Structure without a name.
#include "analysis/residual/null_maxima.h"
#include "analysis/residual/search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

constexpr double kKeptP = 0.01;  // an effect stays beside a curve only if its own p is below

}  // namespace

void Search::add_curves() {
  while (static_cast<int>(result_.curves.size()) < settings_.most_curves && add_best_curve()) {
    drop_what_a_curve_replaces();
    add_effects();
  }
}

bool Search::add_best_curve() {
  settings_.progress("looking for structure without a name");
  Scan scan;
  std::vector<Curve> tried;
  for (std::size_t c = 0; c < curves_.size(); ++c) {
    const bool in = std::any_of(result_.curves.begin(), result_.curves.end(), [&](const FoundCurve& found) {
      return found.curve.covariate == curves_[c].covariate &&
             (found.curve.rotor < 0 || found.curve.rotor == curves_[c].rotor);
    });
    if (in) continue;
    const bool named = std::any_of(result_.accepted.begin(), result_.accepted.end(), [&](const Accepted& a) {
      return is_over(curves_[c], a.term.effect->covariates);
    });
    Curve curve = named ? without_trend(curves_[c], rows_) : curves_[c];
    Candidate candidate = as_candidate(curve);
    if (!can_be_seen(candidate)) continue;
    scan.candidates.push_back(std::move(candidate));
    tried.push_back(std::move(curve));
  }
  if (tried.empty()) return false;
  rank(fit_, scan);
  NullMaxima maxima(*scan.scan, fit_.variances, settings_, 1000 + ++salt_);
  const std::size_t best = scan.order[0];
  const double p = maxima.p(scan.fits[best].evidence);
  Round round;
  round.observed = scan.fits[best].evidence;
  round.null_maxima = maxima.values();
  round.outcome = fmt::format("p = {:.3g} for {}", p, tried[best].label());
  result_.curve_rounds.push_back(std::move(round));
  if (p > settings_.alpha) return false;
  result_.curves.push_back({tried[best], p});
  MeanModel model = fit_.model;
  model.curves.push_back(tried[best]);
  fit_ = fit_jointly(observations_, model, rows_);
  read_back_terms();
  return true;
}

void Search::drop_what_a_curve_replaces() {
  for (std::size_t t = result_.accepted.size(); t-- > 0;) {
    if (result_.accepted[t].term.per_group) continue;  // stands in the baseline
    const bool outshone = outshone_by_curve(result_.accepted[t].term);
    const JointFit without = fit_without(t);
    const double ratio = std::max(0.0, fit_.variances.log_likelihood - without.variances.log_likelihood);
    if (ratio_p(ratio, fit_) < kKeptP && !at_bound(fit_, result_.accepted[t].term) && !outshone) continue;
    result_.accepted.erase(result_.accepted.begin() + static_cast<std::ptrdiff_t>(t));
    fit_ = without;
    read_back_terms();
    if (outshone) restore_trend();
  }
}

bool Search::outshone_by_curve(const Term& term) const {
  const Curve& curve = result_.curves.back().curve;
  if (curve.tilt.empty() || !is_over(curve, term.effect->covariates)) return false;
  const AmplitudeFit fit = fit_amplitudes(observations_, difference(y_, fit_.linear.offset),
                                          fit_.linear.columns, fit_.variances, rows_);
  const auto columns = static_cast<Eigen::Index>(curve.columns.size());
  const Eigen::VectorXd amplitude = fit.amplitude.tail(columns);
  Eigen::MatrixXd drawn = Eigen::MatrixXd::Zero(observations_.rows(), observations_.channels());
  for (Eigen::Index k = 0; k < columns; ++k)
    drawn += amplitude(k) * curve.columns[static_cast<std::size_t>(k)][0];
  const Eigen::MatrixXd predicted = predict_response(observations_, fit_.model, rows_);
  return rms_of(drawn) > rms_of(respond(term, observations_, predicted).value[0]);
}

void Search::restore_trend() {
  Curve& curve = result_.curves.back().curve;
  for (const Curve& plain : curves_)
    if (plain.covariate == curve.covariate && plain.rotor == curve.rotor && plain.shape == curve.shape &&
        plain.columns.size() == curve.columns.size())
      curve = plain;
  fit_.model.curves.back() = curve;
  fit_ = fit_jointly(observations_, fit_.model, rows_);
  read_back_terms();
}

bool Search::session_scatter_is_large() const {
  for (std::size_t s = 0; s < mixed_->strata().size(); ++s) {
    if (!mixed_->strata()[s].means()) continue;
    double below = 0;
    for (std::size_t r = 0; r < fit_.variances.ratio_probability[s].size(); ++r) {
      if (kRatios[r] <= settings_.session_ratio * settings_.session_ratio)
        below += fit_.variances.ratio_probability[s][r];
    }
    if (below < 0.025) return true;
  }
  return false;
}

}  // namespace tunnelrig
