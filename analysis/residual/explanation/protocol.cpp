// The protocol, once: seal, search on the open runs, open the seal, estimate on all.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/likelihood/scores.h"
#include "analysis/residual/search/detectable.h"
#include "calibration/distributions.h"
#include "datasets/error.h"
#include "datasets/first_few.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kFewestBlocks = 6;
constexpr std::size_t kFewestOpenBlocks = 4;  // of six, the seal leaves as many

/// Whether the sealed runs speak against a model: they are predicted clearly worse than without it, and worse
/// than either expects of itself (gross runs among the open ones are taken for scatter). Where an effect does
/// little in them (they lie at its reference) it is chance whether the error grows.
bool speak_against(const HeldOutErrors& with, const HeldOutErrors& without) {
  constexpr double kClearly = 2;  // standard errors, by runs
  const MatrixXd squares = with.error.array().square() - without.error.array().square();
  const Eigen::VectorXd of_runs = squares.array().isNaN().select(0, squares).rowwise().sum();
  return of_runs.sum() > kClearly * of_runs.norm() &&
         rms(with.error) > std::min(rms(with.expected_std), rms(without.expected_std));
}

/// Whether errors are far larger than runs of that scatter make them, by their blocks: each counts as one.
/// The floor is known no better than `dof` residuals tell.
bool is_beyond_floor(const Observations& observations, const ErrorEstimate& estimate, double noise_floor,
                     double dof, const std::vector<int>& scored) {
  constexpr double kFarAboveFloor = 1.25, kCertain = 0.99, kLikely = 0.9;
  if (!(noise_floor > 0)) return false;
  std::set<int> ids;
  for (const int row : scored) ids.insert(observations.block[static_cast<std::size_t>(row)]);
  const double blocks = static_cast<double>(ids.size());
  const double ratio = estimate.held_out_rmse / noise_floor;
  const double highest_floor = noise_floor * std::sqrt(dof / chi2_quantile(1 - kLikely, dof));
  return estimate.held_out_low > kFarAboveFloor * highest_floor ||
         (ratio > kFarAboveFloor && f_upper_p(ratio * ratio, blocks, dof) < 1 - kCertain);
}

/// Residuals that the noise floor is of; of sessions that differ, the sessions.
double residuals_of_floor(const Observations& observations, const JointFit& fit,
                          const std::vector<int>& open) {
  const double rows = degrees_of_freedom(observations, fit, open);
  const auto blocks = static_cast<double>(places_of_each(observations.block, open).size());
  return kRatios[fit.variances.ratio[0]] > 0 ? std::min(rows, blocks - 1) : rows;
}

/// The named terms as they were found beside the curves: fitted without them, they would take up what the
/// curves describe.
JointFit without_curves(JointFit fit, const Observations& observations, const std::vector<int>& rows) {
  fit.model.curves.clear();
  fit.linear = linearise(observations, fit.model, predict_forces(observations, fit.model, rows));
  fit.linear.clear_columns();
  fit.variances = CandidateScan(MixedModel(observations, rows), {}, {})
                      .null_fit(difference(response_components(observations), fit.linear.offset));
  return fit;
}

/// Why nothing can be found out, in words; empty where something can.
std::string too_few(const Observations& observations, const Seal& seal) {
  if (observations.blocks() < kFewestBlocks)
    return fmt::format(
        "{} too few to tell an effect from chance; {} are needed{}",
        observations.blocks() == 1 ? "1 block is" : fmt::format("{} blocks are", observations.blocks()),
        kFewestBlocks,
        observations.from_table && observations.rows() >= kFewestBlocks
            ? " (where rows count as independent: blocks = \"rows\", or bins(column, n))"
            : "");
  const auto open = places_of_each(observations.block, seal.open).size();
  if (open < kFewestOpenBlocks)
    return fmt::format("hold_out leaves {} {}, too few to tell an effect from chance; {} are needed", open,
                       open == 1 ? "block" : "blocks", kFewestOpenBlocks);
  if (MixedModel::baseline_alone(observations, seal.open).dof(0) < 1)
    return fmt::format(
        "the baseline has as many constants as there are {} to fit: nothing is left to explain",
        observations.from_table ? "rows" : "runs");
  if (observations.held_out.empty() && !can_be_scored(observations, seal, seal.sealed))
    return fmt::format(
        "each {0} has {1} in one block only: what it does cannot be told from what the block did, and no {2} "
        "that is held out can be predicted; come back to a {0} in another block",
        observations.from_table ? "group" : "location", observations.from_table ? "rows" : "runs",
        observations.from_table ? "row" : "run");
  return "";
}

/// Errors of the baseline, by leaving blocks out where there are two.
void explain_too_few(const Observations& observations, const SearchSettings& settings,
                     Explanation& explanation) {
  const std::vector<int> rows = observations.all_rows();
  const JointFit fit = fit_jointly(observations, {}, rows);
  explanation.residual_before = explanation.residual_after = residuals(observations, fit, rows);
  explanation.before.rmse = rms(explanation.residual_before);
  explanation.noise_floor = explanation.before.rmse;
  HeldOutErrors errors{.rows = rows,
                       .error = explanation.residual_before,
                       .expected_std = {},
                       .whitened = {},
                       .amplitude = {}};
  if (observations.blocks() > 1) {
    const HeldOutErrors predicted = left_out(observations, fit, rows);
    if (predicted.count() > 0) {
      errors = predicted;
      explanation.noise_floor = rms(predicted.expected_std);
    }
  }
  set_interval(observations, errors, {}, settings.seed, explanation.before);
  explanation.after = explanation.before;
  explanation.detectable =
      observations.response_per_y() *
      detectable_by_one(MixedModel(observations, rows, fit.variances.ratio), fit.variances, settings.alpha);
  // Too few blocks for an effect are enough to see a typing error.
  const HeldOutErrors fitted = score(observations, fit, rows, rows);
  explanation.suspect_rows = gross_rows(
      observations,
      suspect_rows(observations, fitted, fit.variances, degrees_of_freedom(observations, fit, rows)));
  explanation.verdict = "insufficient";
}

std::string only_sealed_in_words(const Observations& observations, const std::vector<std::string>& groups) {
  constexpr std::size_t kNamed = 5;
  return fmt::format("{} in sealed blocks only, so not scored: {}", observations.from_table ? "rows" : "runs",
                     first_few(groups, kNamed));
}

/// What every explanation says first.
Explanation begin_explanation(const Observations& observations) {
  Explanation explanation{.campaign = observations.campaign,
                          .response = observations.response,
                          .unit = observations.unit,
                          .baseline = observations.baseline,
                          .verdict = {},
                          .relative_to = observations.multiplicative ? observations.response_per_y() : 0,
                          .blocks = observations.blocks(),
                          .runs = static_cast<int>(observations.rows()),
                          .model = {}};
  explanation.warnings = observations.left_out;
  for (const auto& [covariate, why] : observations.not_usable)
    explanation.warnings.push_back(
        fmt::format("{} is {}{}", covariate, why,
                    why.starts_with("missing") ? ": what goes with it cannot be seen" : ""));
  return explanation;
}

/// Whichever predicts open blocks from the others better.
Fitted better_of(Fitted one, Fitted other, const std::vector<int>& open) {
  const auto unseen = [&](const Fitted& model) { return rms(left_out(model.data, model.fit, open).error); };
  return unseen(other) < unseen(one) ? std::move(other) : std::move(one);
}

/// What "before" is of: the baseline with the scatter that the search has found of the runs, or as it is
/// fitted where nobody has searched. Weights made of what the baseline lacks would make it look worse than it
/// is.
Fitted fairest_baseline(const Observations& given, const Observations& alone, const Attribution& found,
                        const std::vector<int>& open) {
  Fitted with_scatter{alone, found.baseline};
  if (alone.scatter.alike()) return with_scatter;
  return better_of(std::move(with_scatter), {given, fit_jointly(given, {}, open)}, open);
}

void report_search(const Attribution& found, const Observations& observations, const SearchSettings& settings,
                   Explanation& explanation) {
  if (!found.accepted.empty() && static_cast<int>(found.accepted.size()) >= settings.most_effects)
    explanation.warnings.push_back(
        fmt::format("the search ended with {} effects, as many as --max-effects allows: where there are "
                    "more, these may be wrong; try more",
                    found.accepted.size()));
  if (!found.curves.empty() && static_cast<int>(found.curves.size()) >= settings.most_curves)
    explanation.warnings.push_back(
        fmt::format("the search ended with {} curves, as many as are sought: there may be more structure",
                    found.curves.size()));
  warn_of_bounds(observations, found, explanation);
  explanation.rounds = found.rounds;
  explanation.curve_rounds = found.curve_rounds;
  explanation.detectable = found.detectable_sigma * observations.response_per_y();
  for (const auto& [name, sigma] : found.detectable_by_effect)
    explanation.detectable_by_effect[name] = sigma * observations.response_per_y();
}

/// Sealed runs that a model can be asked for; which are not is said.
std::vector<int> rows_to_score(const MeanModel& model, const Seal& seal, const Observations& observations,
                               Explanation& explanation) {
  const std::vector<int> astride = astride_of_steps(model, seal);
  std::vector<int> scored;
  std::set_difference(seal.sealed.begin(), seal.sealed.end(), astride.begin(), astride.end(),
                      std::back_inserter(scored));
  if (!can_be_scored(observations, seal, scored)) return seal.sealed;
  if (!astride.empty())
    explanation.warnings.push_back(fmt::format(
        "{} of the {} sealed runs lie where a step may be as well, so they are not scored: {} to {}",
        astride.size(), seal.sealed.size(), observations.name[static_cast<std::size_t>(astride.front())],
        observations.name[static_cast<std::size_t>(astride.back())]));
  return scored;
}

/// What "after" is of: the names alone. Without any it is what "before" is of.
Fitted names_alone(const Models& models, const std::vector<int>& open) {
  const Observations& wide = models.wide;
  const Attribution& found = models.found;
  if (found.accepted.empty()) return models.baseline;
  if (found.curves.empty()) return {wide, found.final};
  const auto with_scatter = [&](RunScatter scatter) {
    Fitted names{wide, {}};
    names.data.scatter = std::move(scatter);
    names.fit = without_curves(found.final, names.data, open);
    return names;
  };
  if (wide.scatter.alike()) return with_scatter({});
  return better_of(with_scatter(wide.scatter), with_scatter({}), open);
}

/// Where few blocks make the whole error, it has no interval.
void warn_of_interval(const ErrorEstimate& estimate, const char* which, Explanation& explanation) {
  constexpr double kSaysNothing = 30;  // its upper end over its lower
  if (estimate.held_out_high > kSaysNothing * estimate.held_out_low)
    explanation.warnings.push_back(
        fmt::format("the blocks differ so much in the size of their errors that the interval of the error {} "
                    "says nothing: few of them make all of it",
                    which));
}

/// The seal is opened: nothing that was decided before changes any more. Curves have no name, so they are not
/// part of "after" unless they are asked for.
void open_seal(const Models& models, const Seal& seal, const SearchSettings& settings,
               Explanation& explanation) {
  const auto& [wide, alone, baseline, found] = models;
  const Fitted named = names_alone(models, seal.open);
  const Fitted all_found{wide, found.final};
  const bool all_shown = found.curves.empty() ? !found.accepted.empty() : settings.empirical;
  const Fitted& shown = all_shown ? all_found : named;
  if (settings.empirical)
    for (const FoundCurve& found_curve : found.curves)
      explanation.empirical.push_back(found_curve.curve.label());
  const std::vector<int> scored = rows_to_score(named.fit.model, seal, alone, explanation);
  const auto errors = [&](const Fitted& model) { return score(model.data, model.fit, seal.open, scored); };
  const HeldOutErrors before = errors(baseline), after = errors(shown);
  if (before.count() == 0)
    throw InputError(
        "no row that is held out can be scored: each stands alone in a group that has no other rows; "
        "hold out others");
  const auto with_interval = [&](const HeldOutErrors& sealed, const Fitted& model, ErrorEstimate& estimate) {
    set_interval(models.alone, sealed, left_out(model.data, model.fit, seal.open), settings.seed, estimate);
  };
  with_interval(before, baseline, explanation.before);
  with_interval(after, shown, explanation.after);
  warn_of_interval(explanation.before, "before", explanation);
  if (all_shown || !found.accepted.empty()) warn_of_interval(explanation.after, "after", explanation);
  const HeldOutErrors whole = all_shown ? after : errors(all_found);
  explanation.suspect_rows = apart_from_their_block(alone, found.final.model, whole);
  HeldOutErrors curves = before;
  if (!found.curves.empty()) {
    const JointFit fit = fit_jointly(alone, {.terms = {}, .curves = found.final.model.curves}, seal.open);
    curves = score(alone, fit, seal.open, scored);
  }
  explanation.sealed = {.names = rms(errors(named).error),
                        .curves = rms(curves.error),
                        .all = rms(whole.error),
                        .against_names = speak_against(whole, curves),
                        .against_adopted = speak_against(after, before)};
  explanation.noise_floor = rms(whole.expected_std);
  ErrorEstimate all = explanation.after;
  if (!all_shown) with_interval(whole, all_found, all);  // with the curves, whose structure is said
  explanation.sealed.beyond_floor = is_beyond_floor(alone, all, explanation.noise_floor,
                                                    residuals_of_floor(wide, found.final, seal.open), scored);
  explanation.before.rmse = rms(residuals(baseline.data, baseline.fit, seal.open));
  explanation.after.rmse = rms(residuals(shown.data, shown.fit, seal.open));
}

}  // namespace

std::string verdict_of(const Explanation& explanation) {
  if (explanation.adopted.empty()) return explanation.unknown.empty() ? "no_structure" : "unknown";
  if (!explanation.unknown.empty()) return "partly_explained";
  const bool confounded = std::any_of(explanation.adopted.begin(), explanation.adopted.end(),
                                      [](const AdoptedEffect& a) { return !a.confounded_with.empty(); });
  return confounded ? "confounded" : "explained";
}

Explanation explain_once(const Observations& observations, const std::vector<const Effect*>& effects,
                         const SearchSettings& settings) {
  Explanation explanation = begin_explanation(observations);
  const std::vector<int> rows = observations.all_rows();
  const Seal seal = seal_blocks(observations, settings.seed);
  if (const std::string why = too_few(observations, seal); !why.empty()) {
    report_untestable(observations, effects, rows, explanation);
    explain_too_few(observations, settings, explanation);
    explanation.warnings.push_back(why);
    return explanation;
  }
  const bool own_baselines = observations.groups_within_blocks || !observations.held_out.empty();
  if (!seal.only_sealed.empty() && !own_baselines)
    explanation.warnings.push_back(only_sealed_in_words(observations, seal.only_sealed));
  const Attribution found = attribute(observations, seal.open, effects, settings);
  // What the baseline is held against: the same, without what groups have of their own.
  Observations alone = observations;
  alone.scatter = found.observations.scatter;
  report_untestable(alone, effects, seal.open, explanation);
  warn_of_scatter(found.observations, explanation);
  report_search(found, observations, settings, explanation);
  const Fitted baseline = fairest_baseline(observations, alone, found, seal.open);
  const Models models{found.observations, alone, baseline, found};
  open_seal(models, seal, settings, explanation);
  settings.progress("estimating parameters");
  estimate_on_all(models, observations, effects, settings, explanation);
  warn_of_companions(found.observations, effects, explanation);
  explanation.verdict = verdict_of(explanation);
  return explanation;
}

}  // namespace tunnelrig
