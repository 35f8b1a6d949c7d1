#include "analysis/residual/attribution.h"

#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;

constexpr double kKnownPhysicsWeight = 10;  // theory gives the coefficient: a prior that others lack
constexpr double kKeptP = 0.01;             // an effect stays beside a curve only if its own p is below
constexpr double kSwapDecades = 0.7;        // another explains that much better: it takes the place

double prior_weight(const Term& term, std::size_t ways) {
  const Effect& effect = *term.effect;
  double weight = effect.theory() ? kKnownPhysicsWeight : 1;
  if (effect.scope == EffectScope::kRotor && term.rotor >= 0) weight /= 4;
  if (effect.scope == EffectScope::kPair) weight /= 12;
  if (effect.has_change_point()) weight /= std::max<double>(1, static_cast<double>(ways));
  return weight;
}

/// Early enough that a campaign without effect costs little, and never before the p that was asked for is
/// settled.
class NullMaxima {
 public:
  NullMaxima(const CandidateScan& scan, const NullFit& null, const SearchSettings& settings,
             std::uint64_t salt)
      : scan_(scan), null_(null), settings_(settings), random_(settings.seed * 1000003 + salt) {}

  double p(double evidence) {
    constexpr std::size_t kBatch = 111, kEnough = 30;
    std::size_t above = count(evidence);
    while (maxima_.size() < settings_.simulations && above < kEnough) {
      const auto batch =
          scan_.simulated_maxima(null_, std::min(kBatch, settings_.simulations - maxima_.size()), random_);
      maxima_.insert(maxima_.end(), batch.begin(), batch.end());
      above = count(evidence);
    }
    return (1.0 + static_cast<double>(above)) / (1.0 + static_cast<double>(maxima_.size()));
  }

  /// The evidence that only α of the null campaigns exceed.
  double critical() {
    p(1e9);  // all of them
    std::vector<double> sorted = maxima_;
    std::sort(sorted.begin(), sorted.end());
    const auto rank =
        static_cast<std::size_t>(std::ceil((1 - settings_.alpha) * static_cast<double>(sorted.size() + 1))) -
        1;
    return sorted[std::min(rank, sorted.size() - 1)];
  }
  const std::vector<double>& values() const { return maxima_; }

 private:
  std::size_t count(double evidence) const {
    return static_cast<std::size_t>(
        std::count_if(maxima_.begin(), maxima_.end(), [&](double m) { return m >= evidence; }));
  }

  const CandidateScan& scan_;
  const NullFit& null_;
  const SearchSettings& settings_;
  std::mt19937_64 random_;
  std::vector<double> maxima_;
};

class Search {
 public:
  Search(const Observations& observations, const std::vector<int>& rows,
         const std::vector<const Effect*>& effects, const SearchSettings& settings)
      : observations_(observations),
        rows_(rows),
        settings_(settings),
        mixed_(std::make_unique<MixedModel>(observations_, rows)),
        ways_(all_ways(effects, observations, rows)),
        curves_(curves_to_try(observations, rows)),
        y_(response_components(observations)) {
    for (const Term& way : ways_) ++points_[way.effect->name + std::to_string(way.rotor)];
  }

  Attribution run() {
    result_.baseline = fit_jointly(observations_, {}, rows_);
    fit_ = result_.baseline;
    add_effects();
    add_curves();
    find_confounded();
    result_.session_unknown = session_scatter_is_large();
    result_.final = fit_;
    result_.observations = std::move(observations_);
    return std::move(result_);
  }

 private:
  // --- named effects
  // --------------------------------------------------------------------------------------------------

  void add_effects() {
    while (static_cast<int>(result_.accepted.size()) < settings_.most_effects && add_best_effect())
      swap_weaker();
  }

  bool already_in(const Term& way) const {
    return std::any_of(result_.accepted.begin(), result_.accepted.end(), [&](const Accepted& accepted) {
      const bool another_axis = way.effect->name == "crosstalk" && accepted.term.effect != way.effect;
      return !another_axis && accepted.term.effect->name == way.effect->name &&
             (accepted.term.rotor == way.rotor || accepted.term.rotor < 0 || way.rotor < 0) &&
             accepted.term.other == way.other && !way.effect->has_change_point();
    });
  }

  struct Scan {
    std::vector<Term> ways;
    std::vector<Candidate> candidates;
    std::vector<CandidateFit> fits;
    std::unique_ptr<CandidateScan> scan;
    std::vector<std::size_t> order;  // by evidence, best first
  };

  /// All candidates on top of a model.
  Scan scan_effects(const JointFit& base) const {
    Scan scan;
    const Eigen::MatrixXd predicted = predict_response(observations_, base.model, rows_);
    for (const Term& way : ways_) {
      if (already_in(way)) continue;
      Candidate candidate = candidate_of(way, predicted);
      if (!can_be_seen(candidate)) continue;
      scan.ways.push_back(way);
      scan.candidates.push_back(std::move(candidate));
    }
    rank(base, scan);
    return scan;
  }

  Candidate candidate_of(const Term& way, const Eigen::MatrixXd& predicted) const {
    const EffectParameter& amplitude = way.effect->parameters[0];
    const std::size_t points = points_.at(way.effect->name + std::to_string(way.rotor));
    return {.columns = {respond(way, observations_, predicted).derivative[0]},
            .sign = amplitude.lower >= 0   ? 1
                    : amplitude.upper <= 0 ? -1
                                           : 0,
            .weight = prior_weight(way, points)};
  }

  /// What groups' constants absorb cannot be tested.
  bool can_be_seen(const Candidate& candidate) const {
    double before = 0, after = 0;
    for (std::size_t s = 0; s < mixed_->strata().size(); ++s) {
      Stacked column = mixed_->stack(s, {&candidate.columns[0]});
      before += column.squaredNorm();
      mixed_->project(s, 0, column);
      after += column.squaredNorm();
    }
    return after > 1e-14 * before && after > 0;
  }

  void rank(const JointFit& base, Scan& scan) const {
    scan.scan = std::make_unique<CandidateScan>(*mixed_, base.linear.columns, scan.candidates);
    scan.fits = scan.scan->fit(difference(y_, base.linear.offset));
    scan.order.resize(scan.fits.size());
    std::iota(scan.order.begin(), scan.order.end(), 0U);
    std::sort(scan.order.begin(), scan.order.end(),
              [&](std::size_t a, std::size_t b) { return scan.fits[a].evidence > scan.fits[b].evidence; });
  }

  bool add_best_effect() {
    settings_.progress(fmt::format("looking for effect {}", result_.accepted.size() + 1));
    const Scan scan = scan_effects(fit_);
    Round round;
    if (scan.order.empty()) return false;
    NullMaxima maxima(*scan.scan, fit_.variances, settings_, ++salt_);
    const double p = maxima.p(scan.fits[scan.order[0]].evidence);
    if (p <= settings_.alpha || critical_ == 0) critical_ = maxima.critical();
    round.observed = scan.fits[scan.order[0]].evidence;
    round.critical = critical_;
    round.ranking = ranking(scan, maxima);
    round.null_maxima = maxima.values();
    if (result_.rounds.empty()) set_detectable(scan);
    const bool added = p <= settings_.alpha && accept_first_sound(scan, maxima, round);
    if (!added && round.outcome.empty())
      round.outcome = fmt::format("nothing: p = {:.3g} for {}", p, scan.ways[scan.order[0]].label());
    result_.rounds.push_back(std::move(round));
    return added;
  }

  std::vector<Ranked> ranking(const Scan& scan, NullMaxima& maxima) const {
    std::vector<Ranked> result;
    for (const std::size_t i : scan.order) {
      const bool seen = std::any_of(result.begin(), result.end(), [&](const Ranked& r) {
        return r.term.effect->name == scan.ways[i].effect->name;
      });
      if (seen) continue;
      const double evidence = scan.fits[i].evidence, ratio = scan.fits[i].likelihood_ratio;
      const double amplitude = scan.fits[i].amplitude.size() > 0 ? scan.fits[i].amplitude(0) : 0;
      result.push_back({scan.ways[i], evidence, maxima.p(evidence), amplitude,
                        ratio > 0 ? std::abs(amplitude) / std::sqrt(2 * ratio) : 0});
    }
    return result;
  }

  /// The best candidate whose parameters stay within physics and which predicts blocks that it has not seen.
  bool accept_first_sound(const Scan& scan, NullMaxima& maxima, Round& round) {
    std::vector<const Effect*> refused;
    const CrossValidation before = cross_validate(observations_, difference(y_, fit_.linear.offset),
                                                  fit_.linear.columns, fit_.variances, rows_);
    for (const std::size_t i : scan.order) {
      if (scan.fits[i].evidence < critical_) break;
      if (std::find(refused.begin(), refused.end(), scan.ways[i].effect) != refused.end()) continue;
      refused.push_back(scan.ways[i].effect);
      JointFit fit = fit_with(scan.ways[i], scan.fits[i].amplitude(0));
      const Term& term = fit.model.terms.back();
      if (std::any_of(fit.at_bound.begin(), fit.at_bound.end(), [&](const std::string& b) {
            return b.starts_with(term.effect->name + " " + term.effect->parameters[0].name);
          })) {
        round.outcome += fmt::format("{} would leave its physical bounds; ", term.label());
        continue;
      }
      const CrossValidation after = cross_validate(observations_, difference(y_, fit.linear.offset),
                                                   fit.linear.columns, fit.variances, rows_);
      // Both are scored by the variances of the larger model, so that the difference is the mean's.
      const CrossValidation base = cross_validate(observations_, difference(y_, fit_.linear.offset),
                                                  fit_.linear.columns, fit.variances, rows_);
      const LossDifference gain = compare(base, after);
      if (!(gain.mean > gain.standard_error)) {
        round.outcome += fmt::format("{} does not predict unseen blocks; ", term.label());
        continue;
      }
      result_.accepted.push_back({.term = term,
                                  .p = maxima.p(scan.fits[i].evidence),
                                  .gain = before.rmse() - after.rmse(),
                                  .loss_gain = gain.mean,
                                  .loss_standard_error = gain.standard_error,
                                  .confounded = {}});
      fit_ = std::move(fit);
      read_back_terms();
      if (observations_.channels() == 1 && observations_.groups() > 1) let_groups_differ();
      round.outcome += "accepted " + result_.accepted.back().term.label();
      return true;
    }
    return false;
  }

  /// The newest effect with an amplitude of each group's own, where the data ask for it.
  void let_groups_differ() {
    const Term shared = result_.accepted.back().term;
    Term own = shared;
    own.per_group = true;
    own.at_theory = false;
    own.parameters[0] = 0;
    Observations wider = observations_;
    const TermResponse response = respond(own, wider, predict_response(wider, fit_.model, rows_));
    wider.slopes.conservativeResize(Eigen::NoChange, wider.slopes.cols() + 1);
    wider.slopes.rightCols(1) = response.derivative[0][0];
    MeanModel model = fit_.model;
    model.terms.back() = own;
    JointFit fit = fit_jointly(wider, model, rows_);
    const auto before = sum_of_squares(observations_, fit_), after = sum_of_squares(wider, fit);
    const double more = before.second - after.second;
    if (more <= 0 || after.second <= 0) return;
    const double f = (before.first - after.first) / more / (after.first / after.second);
    if (!(f > 0) || f_upper_p(f, more, after.second) > settings_.alpha) return;
    const LossDifference gain = compare(
        cross_validate(observations_, difference(y_, fit_.linear.offset), fit_.linear.columns, fit.variances,
                       rows_),
        cross_validate(wider, difference(y_, fit.linear.offset), fit.linear.columns, fit.variances, rows_));
    if (!(gain.mean > gain.standard_error)) return;
    observations_ = std::move(wider);
    mixed_ = std::make_unique<MixedModel>(observations_, rows_);
    fit_ = std::move(fit);
    read_back_terms();
  }

  /// Of the runs' means within the fit, and its degrees of freedom.
  std::pair<double, double> sum_of_squares(const Observations& observations, const JointFit& fit) const {
    const MixedModel mixed(observations, rows_);
    const double dof = static_cast<double>(mixed.dof(0) - static_cast<Index>(fit.linear.columns.size()));
    return {std::pow(fit.variances.sigma[0], 2) * static_cast<double>(mixed.dof(0)), dof};
  }

  /// A joint fit with one term more; theory's coefficient where the data do not speak against it.
  JointFit fit_with(Term term, double amplitude) const {
    const EffectParameter& parameter = term.effect->parameters[0];
    term.parameters[0] = std::clamp(amplitude, parameter.lower, parameter.upper);
    MeanModel model = fit_.model;
    model.terms.push_back(term);
    JointFit free = fit_jointly(observations_, model, rows_);
    if (!parameter.theory) return free;
    model = free.model;
    model.terms.back().at_theory = true;
    model.terms.back().parameters[0] = *parameter.theory;
    JointFit fixed = fit_jointly(observations_, model, rows_);
    constexpr double kHalfChi2_95 = 1.92;
    const bool allowed = free.variances.log_likelihood - fixed.variances.log_likelihood < kHalfChi2_95;
    return allowed || term.effect->theory_only ? fixed : free;
  }

  void read_back_terms() {
    for (std::size_t t = 0; t < result_.accepted.size(); ++t) result_.accepted[t].term = fit_.model.terms[t];
  }

  /// With a new effect in, an older one may be explained better by another: it gives way.
  void swap_weaker() {
    for (std::size_t t = 0; t + 1 < result_.accepted.size(); ++t) {
      const Accepted old = result_.accepted[t];
      if (old.term.per_group) continue;
      const JointFit without = fit_without(t);
      result_.accepted.erase(result_.accepted.begin() + static_cast<std::ptrdiff_t>(t));
      const Scan scan = scan_effects(without);
      const double own = evidence_of(scan, old.term);
      const std::size_t best = scan.order.empty() ? 0 : scan.order[0];
      const bool swap = !scan.order.empty() && !scan.ways[best].same_way(old.term) &&
                        scan.fits[best].evidence > own + kSwapDecades;
      Accepted kept = old;
      if (swap) {
        const JointFit current = fit_;
        fit_ = without;
        JointFit tried = fit_with(scan.ways[best], scan.fits[best].amplitude(0));
        if (tried.variances.log_likelihood > current.variances.log_likelihood && tried.at_bound.empty()) {
          fit_ = std::move(tried);
          kept.term = fit_.model.terms.back();
        } else {
          fit_ = current;
          result_.accepted.insert(result_.accepted.begin() + static_cast<std::ptrdiff_t>(t), old);
          continue;
        }
        result_.accepted.push_back(kept);
        read_back_terms();
      } else {
        result_.accepted.insert(result_.accepted.begin() + static_cast<std::ptrdiff_t>(t), old);
      }
    }
  }

  double evidence_of(const Scan& scan, const Term& term) const {
    double highest = 0;
    for (std::size_t i = 0; i < scan.ways.size(); ++i)
      if (scan.ways[i].same_way(term)) highest = std::max(highest, scan.fits[i].evidence);
    return highest;
  }

  JointFit fit_without(std::size_t t) const {
    MeanModel model = fit_.model;
    model.terms.erase(model.terms.begin() + static_cast<std::ptrdiff_t>(t));
    return fit_jointly(observations_, model, rows_);
  }

  // --- structure without a name
  // ---------------------------------------------------------------------------------------

  void add_curves() {
    while (static_cast<int>(result_.curves.size()) < settings_.most_curves && add_best_curve()) {
      drop_what_a_curve_replaces();
      add_effects();
    }
  }

  bool add_best_curve() {
    settings_.progress("looking for structure without a name");
    Scan scan;
    std::vector<std::size_t> tried;
    for (std::size_t c = 0; c < curves_.size(); ++c) {
      const bool in = std::any_of(result_.curves.begin(), result_.curves.end(), [&](const FoundCurve& found) {
        return found.curve.covariate == curves_[c].covariate &&
               (found.curve.rotor < 0 || found.curve.rotor == curves_[c].rotor);
      });
      if (in) continue;
      Candidate candidate = as_candidate(curves_[c]);
      if (!can_be_seen(candidate)) continue;
      scan.candidates.push_back(std::move(candidate));
      tried.push_back(c);
    }
    if (tried.empty()) return false;
    rank(fit_, scan);
    NullMaxima maxima(*scan.scan, fit_.variances, settings_, 1000 + ++salt_);
    const std::size_t best = scan.order[0];
    const double p = maxima.p(scan.fits[best].evidence);
    Round round;
    round.observed = scan.fits[best].evidence;
    round.null_maxima = maxima.values();
    round.outcome = fmt::format("p = {:.3g} for {}", p, curves_[tried[best]].label());
    result_.curve_rounds.push_back(std::move(round));
    if (p > settings_.alpha) return false;
    result_.curves.push_back({curves_[tried[best]], p});
    MeanModel model = fit_.model;
    model.curves.push_back(curves_[tried[best]]);
    fit_ = fit_jointly(observations_, model, rows_);
    read_back_terms();
    return true;
  }

  /// A name whose work a curve does as well was the wrong name for that curve.
  void drop_what_a_curve_replaces() {
    for (std::size_t t = result_.accepted.size(); t-- > 0;) {
      if (result_.accepted[t].term.per_group) continue;  // stands in the baseline
      const JointFit without = fit_without(t);
      const double ratio = std::max(0.0, fit_.variances.log_likelihood - without.variances.log_likelihood);
      const double z = std::sqrt(2 * ratio);
      if (std::erfc(z / std::numbers::sqrt2) < kKeptP) continue;
      result_.accepted.erase(result_.accepted.begin() + static_cast<std::ptrdiff_t>(t));
      fit_ = without;
      read_back_terms();
    }
  }

  bool session_scatter_is_large() const {
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

  // --- what cannot be told apart
  // --------------------------------------------------------------------------------------

  void find_confounded() {
    const std::vector<Accepted> all = result_.accepted;
    for (std::size_t t = 0; t < all.size(); ++t) {
      if (all[t].term.per_group) {
        confounded_.push_back(rivals_in_groups(all[t]));
        continue;
      }
      const JointFit without = fit_without(t);
      result_.accepted.erase(result_.accepted.begin() + static_cast<std::ptrdiff_t>(t));
      const Scan scan = scan_effects(without);
      result_.accepted = all;
      result_.accepted[t].confounded = rivals(all[t], without, scan);
      for (std::size_t k = 0; k < t; ++k) result_.accepted[k].confounded = confounded_[k];
      confounded_.push_back(result_.accepted[t].confounded);
    }
    for (std::size_t t = 0; t < confounded_.size(); ++t) result_.accepted[t].confounded = confounded_[t];
  }

  /// One way of each other effect that α would let in and that predicts unseen blocks about as well.
  std::vector<Ranked> rivals(const Accepted& accepted, const JointFit& without, const Scan& scan) const {
    std::vector<Ranked> result;
    const Components y = difference(y_, without.linear.offset);
    const auto validate = [&](const Candidate& candidate) {
      std::vector<Components> columns = without.linear.columns;
      columns.push_back(candidate.columns[0]);
      return cross_validate(observations_, y, columns, fit_.variances, rows_);
    };
    std::optional<CrossValidation> own;
    for (const std::size_t i : scan.order)
      if (!own && scan.ways[i].effect->name == accepted.term.effect->name &&
          scan.ways[i].rotor == accepted.term.rotor)
        own = validate(scan.candidates[i]);
    if (!own) return result;
    std::vector<std::string> done = {accepted.term.effect->name};
    for (const std::size_t i : scan.order) {
      if (scan.fits[i].evidence < critical_) break;
      const std::string& name = scan.ways[i].effect->name;
      if (std::count(done.begin(), done.end(), name) >= 3) continue;  // three ways of each are tried
      done.push_back(name);
      if (name == accepted.term.effect->name) continue;
      const bool listed = std::any_of(result.begin(), result.end(),
                                      [&](const Ranked& r) { return r.term.effect->name == name; });
      if (listed) continue;
      const LossDifference difference = compare(validate(scan.candidates[i]), *own);
      if (difference.mean >= 2 * std::min(difference.standard_error, difference.expected_standard_error))
        continue;
      Term term = scan.ways[i];
      term.parameters[0] = scan.fits[i].amplitude(0);
      result.push_back({term, scan.fits[i].evidence, 0, scan.fits[i].amplitude(0), 0});
    }
    return result;
  }

  /// The same for an effect with an amplitude of each group's own: each rival takes its place in the
  /// baseline.
  std::vector<Ranked> rivals_in_groups(const Accepted& accepted) const {
    std::vector<Ranked> result;
    Index place = observations_.slopes.cols();
    for (auto other = result_.accepted.rbegin(); other != result_.accepted.rend(); ++other) {
      if (!other->term.per_group) continue;
      --place;
      if (other->term.effect == accepted.term.effect) break;
    }
    const Eigen::MatrixXd predicted = predict_response(observations_, {}, rows_);
    const Components y = difference(y_, fit_.linear.offset);
    const CrossValidation own = cross_validate(observations_, y, fit_.linear.columns, fit_.variances, rows_);
    for (const Term& way : ways_) {
      const std::string& name = way.effect->name;
      const bool taken = already_in(way) || std::any_of(result.begin(), result.end(), [&](const Ranked& r) {
                           return r.term.effect->name == name;
                         });
      if (taken) continue;
      Observations other = observations_;
      other.slopes.col(place) = respond(way, observations_, predicted).derivative[0][0];
      const LossDifference difference_of_loss =
          compare(cross_validate(other, y, fit_.linear.columns, fit_.variances, rows_), own);
      const double error =
          std::min(difference_of_loss.standard_error, difference_of_loss.expected_standard_error);
      if (difference_of_loss.mean < 2 * error) result.push_back({.term = way});
    }
    return result;
  }

  /// An effect of typical shape, at the size that passes α four times in five.
  void set_detectable(const Scan& scan) {
    std::vector<double> rms;
    for (std::size_t i = 0; i < scan.candidates.size(); ++i) {
      if (scan.fits[i].likelihood_ratio <= 0) continue;
      const double z = std::sqrt(2 * scan.fits[i].likelihood_ratio);
      const double size = std::abs(scan.fits[i].amplitude(0)) * rms_of(scan.candidates[i].columns[0][0]);
      if (size > 0) rms.push_back(size / z);
    }
    if (rms.empty()) return;
    std::nth_element(rms.begin(), rms.begin() + static_cast<std::ptrdiff_t>(rms.size() / 2), rms.end());
    // evidence to standard errors: −log10 p of a two-sided normal deviate, and 0.84 for four in five
    double z = 0;
    while (-std::log10(std::erfc(z / std::numbers::sqrt2)) < critical_) z += 0.01;
    result_.detectable_sigma = (z + 0.84) * rms[rms.size() / 2];
  }

  double rms_of(const Eigen::MatrixXd& column) const {
    Stacked stacked(0, 0);
    double squares = 0;
    Index count = 0;
    for (std::size_t s = 0; s < mixed_->strata().size(); ++s) {
      if (!mixed_->strata()[s].means()) continue;
      Components components(1 + observations_.shape.size(),
                            Eigen::MatrixXd::Zero(observations_.rows(), observations_.channels()));
      components[0] = column;
      stacked = mixed_->stack(s, {&components});
      mixed_->project(s, 0, stacked);
      squares += stacked.squaredNorm();
      count += stacked.size();
    }
    return std::sqrt(squares / static_cast<double>(count));
  }

  Observations observations_;  // a group's own amplitudes become a part of its baseline
  const std::vector<int>& rows_;
  const SearchSettings& settings_;
  std::unique_ptr<MixedModel> mixed_;
  std::vector<Term> ways_;
  std::vector<Curve> curves_;
  Components y_;
  std::map<std::string, std::size_t> points_;  // change-points tried of an effect and rotor
  JointFit fit_;
  Attribution result_;
  std::vector<std::vector<Ranked>> confounded_;
  double critical_ = 0;
  std::uint64_t salt_ = 0;
};

}  // namespace

std::vector<Term> all_ways(const std::vector<const Effect*>& effects, const Observations& observations,
                           const std::vector<int>& rows) {
  std::vector<Term> ways;
  for (const Effect* effect : effects) {
    if (!testability(*effect, observations).ok()) continue;
    for (Term& way : ways_to_try(*effect, observations, rows)) ways.push_back(std::move(way));
  }
  return ways;
}

Attribution attribute(const Observations& observations, const std::vector<int>& rows,
                      const std::vector<const Effect*>& effects, const SearchSettings& settings) {
  return Search(observations, rows, effects, settings).run();
}

}  // namespace tunnelrig
