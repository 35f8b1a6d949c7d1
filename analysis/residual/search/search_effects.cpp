// Named effects: ranked, tried, accepted one by one.
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/null_maxima.h"
#include "analysis/residual/search/search.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;

constexpr double kKnownPhysicsWeight = 10;  // theory gives the coefficient: a prior that others lack
constexpr double kRareWeight = 10;       // stiff blades do not flex, while a Reynolds number all blades have
constexpr double kTheoryRefused = 0.05;  // p at which the data speak against theory's coefficient
constexpr double kClearDecades = 2;      // beyond the one that is accepted: worth a word

double prior_weight(const Term& term, const Observations& observations, std::size_t ways) {
  const Effect& effect = *term.effect;
  double weight = effect.theory() ? kKnownPhysicsWeight : 1;
  // Of a C_T that goes with the speed a cell that bends as much is the rarest cause.
  const bool bent_cell = effect.origin == EffectOrigin::kCharacteristic && observations.coefficient;
  if (effect.rare || bent_cell) weight /= kRareWeight;
  const auto rotors = static_cast<double>(observations.channels());
  if (effect.scope == EffectScope::kRotor && term.rotor >= 0) weight /= rotors;
  if (effect.scope == EffectScope::kPair) weight /= std::max(1.0, rotors * (rotors - 1));
  if (effect.has_change_point()) weight /= std::max<double>(1, static_cast<double>(ways));
  return weight;
}

/// What has another coefficient than theory's has no theory for it.
bool refuses_theory(const Term& way, const CandidateFit& fit) {
  const Effect& effect = *way.effect;
  if (!effect.theory() || effect.theory_only || !(fit.likelihood_ratio > 0)) return false;
  const double off = 1 - *effect.theory() / fit.amplitude(0);
  return fit.likelihood_ratio * off * off > kRatioOfOneParameter;
}

}  // namespace

void Search::add_effects() {
  bool wider = true;
  while (wider) {
    while (static_cast<int>(found_.accepted.size()) < data_.settings().most_effects && add_best_effect()) {
      ask_older_again();
      while (change_a_form()) {
      }
    }
    wider = let_any_differ();
  }
}

bool Search::already_in(const Term& way, const MeanModel& model) const {
  const auto is_of = [&](const Term& term) {
    const bool another_step =
        way.effect->has_change_point() && !std::equal(way.parameters.begin() + 1, way.parameters.end(),
                                                      term.parameters.begin() + 1, term.parameters.end());
    return term.effect->cause() == way.effect->cause() && !another_step && term.other == way.other;
  };
  const auto of_own_rotor = std::ranges::count_if(
      model.terms, [&](const Term& term) { return is_of(term) && term.rotor == way.rotor; });
  // What all do beside what single ones do is one more, as long as one has none of its own.
  const auto of_single =
      std::ranges::count_if(model.terms, [&](const Term& term) { return is_of(term) && term.rotor >= 0; });
  return of_own_rotor > 0 || (way.rotor < 0 && of_single >= data_.observations().channels());
}

Search::Scan Search::scan_effects(const JointFit& base) const {
  Scan scan = list_effects(base);
  rank(base, scan);
  return scan;
}

Search::Scan Search::list_effects(const JointFit& base) const {
  Scan scan;
  const Eigen::MatrixXd predicted = predict_response(data_.observations(), base.model, data_.rows());
  for (const Term& way : data_.ways()) {
    if (already_in(way, base.model) || was_beyond_bounds(way)) continue;
    Candidate candidate = candidate_of(way, predicted);
    const Components& column = candidate.columns[0];
    if (is_work_of_a_curve(way, column[0], predicted) || !data_.mixed().sees(column)) continue;
    scan.ways.push_back(way);
    scan.candidates.push_back(std::move(candidate));
  }
  return scan;
}

std::optional<BeyondBounds> Search::beyond_bounds(Term way, double start) const {
  constexpr double kWidths = 10;
  const EffectParameter& bounded = way.effect->parameters[0];
  Effect freed = *way.effect;
  freed.parameters[0].lower -= kWidths * (bounded.upper - bounded.lower);
  freed.parameters[0].upper += kWidths * (bounded.upper - bounded.lower);
  MeanModel model = found_.fit.model;
  model.terms.push_back(way);
  model.terms.back().effect = &freed;
  model.terms.back().parameters[0] = start;
  const double amplitude =
      fit_jointly(data_.observations(), model, data_.rows()).model.terms.back().parameters[0];
  if (!(amplitude < bounded.lower || amplitude > bounded.upper)) return std::nullopt;
  return BeyondBounds{std::move(way), amplitude};
}

bool Search::was_beyond_bounds(const Term& way) const {
  return std::ranges::any_of(found_.beyond_bounds, [&](const BeyondBounds& beyond) {
    return beyond.term.effect->name == way.effect->name &&
           std::ranges::any_of(found_.curves, [&](const FoundCurve& found) {
             return is_over(found.curve, own_conditions(*way.effect, data_.observations()));
           });
  });
}

Candidate Search::candidate_of(const Term& way, const Eigen::MatrixXd& predicted) const {
  const EffectParameter& amplitude = way.effect->parameters[0];
  const std::size_t points = data_.ways_like(way);
  return {.columns = {respond(way, data_.observations(), predicted).derivative[0]},
          .sign = amplitude.lower >= 0   ? 1
                  : amplitude.upper <= 0 ? -1
                                         : 0,
          .weight = prior_weight(way, data_.observations(), points)};
}

void Search::rank(const JointFit& base, Scan& scan) const {
  scan.scan = std::make_unique<CandidateScan>(data_.mixed(), base.linear.columns, scan.candidates);
  scan.fits = scan.scan->fit(difference(data_.y(), base.linear.offset));
  for (std::size_t i = 0; i < scan.ways.size(); ++i)
    if (refuses_theory(scan.ways[i], scan.fits[i])) scan.fits[i].evidence -= std::log10(kKnownPhysicsWeight);
  scan.order.resize(scan.fits.size());
  std::iota(scan.order.begin(), scan.order.end(), 0U);
  std::sort(scan.order.begin(), scan.order.end(),
            [&](std::size_t a, std::size_t b) { return scan.fits[a].evidence > scan.fits[b].evidence; });
}

bool Search::add_best_effect() {
  data_.settings().progress(fmt::format("looking for effect {}", found_.accepted.size() + 1));
  const Scan scan = scan_effects_and_groups(found_.fit);
  Round round;
  if (scan.order.empty()) return false;
  NullMaxima maxima = maxima_of(found_.fit, scan, Draws::kEffects);
  const double p = maxima.p(scan.fits[scan.order[0]].evidence);
  if (p <= data_.settings().alpha || found_.critical == 0) found_.critical = maxima.critical();
  round.observed = scan.fits[scan.order[0]].evidence;
  round.critical =
      p <= data_.settings().alpha ? found_.critical : critical_of(maxima.values(), data_.settings().alpha);
  round.ranking = ranking(scan, maxima);
  round.null_maxima = maxima.values();
  if (result_.rounds.empty()) set_detectable(scan);
  const bool added = p <= data_.settings().alpha && accept_first_sound(scan, maxima, round);
  if (!added && round.outcome.empty())
    round.outcome = fmt::format("nothing: p = {:.3g} for {}", p, scan.ways[scan.order[0]].label());
  result_.rounds.push_back(std::move(round));
  return added;
}

NullMaxima Search::maxima_of(const JointFit& fit, const Scan& scan, Draws what) {
  return maxima_of(fit, scan, what, data_.settings());
}

NullMaxima Search::maxima_of(const JointFit& fit, const Scan& scan, Draws what,
                             const SearchSettings& settings) {
  const std::size_t best = scan.order[0];
  return {*scan.scan, fit.variances, sizes_beside(fit, scan.candidates[best], scan.fits[best]), settings,
          static_cast<std::uint64_t>(what) + ++questions_};
}

std::vector<Ranked> Search::ranking(const Scan& scan, NullMaxima& maxima) const {
  std::vector<Ranked> result;
  for (const std::size_t i : scan.order) {
    const bool seen = std::any_of(result.begin(), result.end(), [&](const Ranked& r) {
      return r.term.effect->name == scan.ways[i].effect->name;
    });
    if (seen) continue;
    const CandidateFit& fit = scan.fits[i];
    const bool one = fit.amplitude.size() == 1 && fit.likelihood_ratio > 0;
    const double amplitude = fit.amplitude.size() > 0 ? fit.amplitude.mean() : 0;
    result.push_back({scan.ways[i], fit.evidence, maxima.p(fit.evidence), amplitude,
                      one ? std::abs(amplitude) / std::sqrt(2 * fit.likelihood_ratio) : 0});
  }
  return result;
}

bool Search::accept_first_sound(const Scan& scan, NullMaxima& maxima, Round& round) {
  std::vector<const Effect*> tried;
  std::optional<BeyondBounds> beyond;  // of the first, and none about as good is accepted
  const std::size_t had = found_.accepted.size();
  for (const std::size_t best : scan.order) {
    if (scan.fits[best].evidence < found_.critical) break;
    if (beyond && scan.fits[best].evidence < scan.fits[scan.order[0]].evidence - kClearDecades)
      found_.beyond_bounds.push_back(*std::exchange(beyond, std::nullopt));
    const bool together = scan.others.contains(best);
    if (!together) {
      if (std::ranges::find(tried, scan.ways[best].effect) != tried.end()) continue;
      tried.push_back(scan.ways[best].effect);
    }
    if (!(together ? accept_together(scan, best, maxima.p(scan.fits[best].evidence))
                   : accept(scan, best, maxima, round, beyond)))
      continue;
    std::vector<std::string> labels;
    for (std::size_t k = had; k < found_.accepted.size(); ++k)
      labels.push_back(found_.accepted[k].term.label());
    round.outcome += fmt::format("accepted {}", fmt::join(labels, " and "));
    return true;
  }
  if (beyond) found_.beyond_bounds.push_back(*beyond);
  return false;
}

bool Search::accept(const Scan& scan, std::size_t best, NullMaxima& maxima, Round& round,
                    std::optional<BeyondBounds>& beyond) {
  const std::size_t i = alike_instead(scan, best);
  if (scan.ways[i].per_group) {
    if (accept_in_groups(scan.ways[i], maxima.p(scan.fits[i].evidence))) return true;
    round.outcome +=
        fmt::format("{} predicts unseen blocks no better, or not better than what is alike in all; ",
                    scan.ways[i].label());
    return false;
  }
  JointFit fit = fit_with(scan.ways[i], scan.fits[i].amplitude(0));
  const CrossValidation after = unseen(fit, fit.variances);
  // Both are scored by the variances of the larger model, so that the difference is the mean's.
  if (const auto reason = why_not(fit, after, compare(unseen(found_.fit, fit.variances), after))) {
    round.outcome += *reason + "; ";
    if (scan.ways[best].per_group && accept_in_groups(scan.ways[best], maxima.p(scan.fits[best].evidence)))
      return true;
    const Term& bounded = fit.model.terms.back();
    if (best == scan.order[0] && at_bound(fit, bounded) && !lacks_speed_squared(bounded))
      beyond = beyond_bounds(scan.ways[i], scan.fits[i].amplitude(0));
    return false;
  }
  Accepted newest{.term = fit.model.terms.back(), .p = maxima.p(scan.fits[i].evidence), .confounded = {}};
  found_.accept(std::move(newest), at_best_run(std::move(fit), 1));
  let_groups_differ(found_.accepted.size() - 1, true);
  return true;
}

void Search::measure_gains() {
  const double with = unseen(found_.fit, found_.fit.variances).rmse();
  for (std::size_t t = 0; t < found_.accepted.size(); ++t) {
    Observations others = found_.accepted[t].term.per_group
                              ? without_own(data_.observations(), found_.fit.model, t)
                              : data_.observations();
    const JointFit without = fit_in_turns(others, found_.fit.model.without_term(t), data_.rows());
    found_.accepted[t].gain = unseen(others, without, without.variances).rmse() - with;
  }
}

CrossValidation Search::unseen(const Observations& observations, const JointFit& fit,
                               const NullFit& variances) const {
  return cross_validate(observations, difference(data_.y(), fit.linear.offset), fit.linear.columns, variances,
                        data_.rows());
}

std::vector<Components> Search::columns_with(const std::vector<Components>& more) const {
  std::vector<Components> columns = found_.fit.linear.columns;
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

CrossValidation Search::unseen_with(const std::vector<Components>& columns, const NullFit& variances) const {
  return cross_validate(data_.observations(), difference(data_.y(), found_.fit.linear.offset), columns,
                        variances, data_.rows());
}

std::optional<std::string> Search::why_not(const JointFit& fit, const CrossValidation& after,
                                           const LossDifference& gain) const {
  const Term& term = fit.model.terms.back();
  // Its own amplitude, and those of the effects before it, which it may push out.
  for (auto each = fit.model.terms.rbegin(); each != fit.model.terms.rend(); ++each) {
    if (!at_bound(fit, *each)) continue;
    return each->same_way(term)
               ? fmt::format("{} would leave its physical bounds", term.label())
               : fmt::format("with {}, {} would leave its physical bounds", term.label(), each->label());
  }
  if (!(gain.mean > gain.standard_error))
    return fmt::format("{} does not predict unseen blocks", term.label());
  if (lacks_speed_squared(term))
    return fmt::format("{} without rotor_speed is no way of the speed", term.label());
  if (const auto shared = only_bends(term, fit.variances, after))
    return fmt::format("{} is no more than a bend over {}", term.label(), *shared);
  if (const Term* other = cancelled_by_newest(fit))
    return fmt::format("{} and {} would cancel each other", term.label(), other->label());
  if (term.effect->has_change_point() && is_gradual({term}, fit.variances, after))
    return fmt::format("{} is no better than a gradual change", term.label());
  return std::nullopt;
}

JointFit Search::fit_with(const JointFit& base, Term term, double amplitude) const {
  const EffectParameter& parameter = term.effect->parameters[0];
  term.parameters[0] = std::clamp(amplitude, parameter.lower, parameter.upper);
  MeanModel model = base.model;
  model.terms.push_back(term);
  JointFit free = fit_jointly(data_.observations(), model, data_.rows());
  if (!parameter.theory) return free;
  model = free.model;
  model.terms.back().at_theory = true;
  model.terms.back().parameters[0] = *parameter.theory;
  JointFit fixed = fit_jointly(data_.observations(), model, data_.rows());
  const double ratio = std::max(0.0, free.variances.log_likelihood - fixed.variances.log_likelihood);
  const bool allowed = ratio_p(ratio, free) > kTheoryRefused;
  return allowed || term.effect->theory_only ? fixed : free;
}

double Search::ratio_p(double ratio, const JointFit& fit) const {
  Index dof = -static_cast<Index>(fit.linear.columns.size());
  for (std::size_t s = 0; s < data_.mixed().strata().size(); ++s) dof += data_.mixed().dof(s);
  const double n = static_cast<double>(std::max<Index>(dof, 1));
  return f_upper_p(std::expm1(2 * ratio / (n + 1)) * n, 1, n);
}

void Search::set_detectable(const Scan& scan) {
  std::map<std::string, std::vector<std::pair<double, std::size_t>>> errors;  // rms of one; of each way
  for (std::size_t i = 0; i < scan.candidates.size(); ++i) {
    const Term& way = scan.ways[i];
    const bool alike = way.rotor < 0 || way.effect->scope == EffectScope::kPair;
    if (!alike || way.per_group || scan.others.contains(i)) continue;
    const double z = std::sqrt(2 * scan.fits[i].likelihood_ratio);
    const double size =
        std::abs(scan.fits[i].amplitude(0)) * rms_beside_baseline(data_, scan.candidates[i].columns[0][0]);
    if (z > 0 && size > 0) errors[way.effect->name].emplace_back(size / z, i);
  }
  if (errors.empty()) return;
  std::vector<std::string> names;
  std::vector<Candidate> typical;
  for (auto& [name, ways] : errors) {
    std::sort(ways.begin(), ways.end());
    names.push_back(name);
    typical.push_back(scan.candidates[ways[ways.size() / 2].second]);
  }
  constexpr std::size_t kDataSets = 100, kFourInFive = 80;
  std::mt19937_64 random(data_.settings().seed);
  const Eigen::MatrixXd amplitude =
      CandidateScan(data_.mixed(), {}, typical)
          .critical_amplitudes(found_.fit.variances, found_.critical, kDataSets, random);
  double largest = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    Eigen::VectorXd own = amplitude.col(static_cast<Index>(i));
    std::nth_element(own.begin(), own.begin() + kFourInFive - 1, own.end());
    const double needed = own(kFourInFive - 1) * rms_beside_baseline(data_, typical[i].columns[0][0]);
    if (!std::isfinite(needed)) continue;
    result_.detectable_by_effect[names[i]] = needed;
    largest = std::max(largest, needed);
  }
  if (largest > 0) result_.detectable_sigma = largest;
}

}  // namespace tunnelrig
