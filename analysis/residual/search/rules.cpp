#include "analysis/residual/search/rules.h"

#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/one_block.h"
#include "analysis/residual/search/unseen.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;

/// The covariate that an effect shares with an accepted one, if a bend over it predicts unseen blocks about
/// as well: what two names over one covariate do together, a curve does too, and their sum is no evidence of
/// a second cause.
std::optional<std::string> only_bends(const SearchData& data, const Found& found, const Term& term,
                                      const NullFit& variances, const CrossValidation& with_term) {
  // A law that the baseline has, of a condition that is no load of a cell, may bend as well as the cell.
  const bool of_law = goes_by_the_law_alone(*term.effect, data.observations());
  for (const Curve& curve : data.curves_to_try()) {
    const auto shares = [&](const Accepted& other) {
      return is_over(curve, own_conditions(*other.term.effect, data.observations())) &&
             (other.term.rotor < 0 || other.term.rotor == term.rotor);
    };
    if (!is_bend_over(curve, own_conditions(*term.effect, data.observations()), term.rotor) ||
        (!of_law && std::ranges::none_of(found.accepted, shares)))
      continue;
    const CrossValidation with_bend = unseen_with(
        data, found.fit, columns_with(found.fit, {without_trend(curve, data.rows()).columns[0]}), variances);
    if (!compare(with_bend, with_term).told_apart()) return curve.covariate;
  }
  return {};
}

/// Whether a block has runs on which a term acts that no other block says anything of: what happened there
/// may be anything.
bool is_told_by_one_block(const CrossValidation& without, const CrossValidation& with) {
  for (std::size_t fold = 0; fold < with.folds.size(); ++fold)
    if (with.folds[fold].undetermined && !without.folds[fold].undetermined) return true;
  return false;
}

/// Whether the runs without one block say nothing of a fit's last term. Theory's coefficient is not the
/// data's; of single rows a wild one is told by itself.
bool is_shown_by_one_block(const SearchData& data, const Found& found, const JointFit& fit) {
  constexpr double kChance = 0.05;
  const Term& term = fit.model.terms.back();
  const auto amplitude = fit.linear.column_of({fit.model.terms.size() - 1, 0});
  if (data.observations().blocks_are_rows || !amplitude || term.at_theory || term.per_group ||
      term.effect->theory_only)
    return false;
  const std::vector<Components> column{fit.linear.columns[static_cast<std::size_t>(*amplitude)]};
  const int block = block_missed_most(data, found.fit, column);
  return fits_without(data, found.fit, block, {{.columns = column}}).front().evidence < -std::log10(kChance);
}

/// An effect over a condition of the model's last that is, together with that, no more than a small part of
/// either: two formulas that differ little make any shape over it. None: null. Of `fit`.
const Term* cancelled_by_newest(const SearchData& data, const JointFit& fit) {
  constexpr double kSmallPart = 1.0 / 3;
  const Term& newest = fit.model.terms.back();
  const Eigen::MatrixXd predicted = predict_response(data.observations(), fit.model, data.rows());
  const auto made_by = [&](const Term& term) {
    return respond(term, data.observations(), predicted).value[0];
  };
  const Eigen::MatrixXd of_newest = made_by(newest);
  for (const Term& other : fit.model.terms) {
    if (&other == &newest || other.per_group || other.rotor != newest.rotor ||
        !share_a_condition(*newest.effect, *other.effect, data.observations()))
      continue;
    const Eigen::MatrixXd older = made_by(other);
    if (rms_beside_baseline(data, of_newest + older) <
        kSmallPart * std::min(rms_beside_baseline(data, of_newest), rms_beside_baseline(data, older)))
      return &other;
  }
  return nullptr;
}

}  // namespace

/// The baseline of a campaign has the nominal speed, and a table's law over a throttle none, so what the
/// measured speed does begins with its square. A weaker dependence without it is a reading that scatters, or
/// something else.
bool lacks_speed_squared(const SearchData& data, const Found& found, const Term& term) {
  const auto& covariates = term.effect->covariates;
  const bool of_speed = std::find(covariates.begin(), covariates.end(), "speed_rpm") != covariates.end();
  const auto is_square = [](const Term& way) { return way.effect->origin == EffectOrigin::kSpeedSquared; };
  const bool has_none = !data.observations().from_table || std::ranges::any_of(data.ways(), is_square);
  return has_none && of_speed && !is_square(term) &&
         std::none_of(found.accepted.begin(), found.accepted.end(),
                      [&](const Accepted& accepted) { return is_square(accepted.term); });
}

bool is_gradual(const SearchData& data, const JointFit& base, const std::vector<Term>& steps,
                const NullFit& variances, const CrossValidation& with_steps) {
  const Eigen::MatrixXd predicted = predict_response(data.observations(), base.model, data.rows());
  std::vector<Components> always;  // of each step, as if it had been from the first run on
  for (Term step : steps) {
    step.parameters[step.effect->change_point().value()] = 0;
    always.push_back(respond(step, data.observations(), predicted).derivative[0]);
  }
  std::vector<Components> columns = base.linear.columns;
  const double half = static_cast<double>(data.observations().rows() - 1) / 2;
  for (const int power : {1, 2, 3}) {
    for (const Components& after : always) {
      columns.push_back(after);
      for (Eigen::MatrixXd& component : columns.back())
        for (Index row = 0; row < component.rows(); ++row)
          component.row(row) *= std::pow(static_cast<double>(row) / half - 1, power);
    }
    if (compare(unseen_with(data, base, columns, variances), with_steps).mean <= 0) return true;
  }
  // That the line or power law of the baseline holds all along is an assumption (a wing stalls).
  return std::ranges::any_of(data.curves_to_try(), [&](const Curve& curve) {
    if (data.observations().baseline_over.empty() || !is_over(curve, {data.observations().baseline_over}) ||
        curve.strength || curve.rotor >= 0)
      return false;
    return !compare(unseen_with(data, base, columns_with(base, curve.columns), variances), with_steps)
                .told_apart();
  });
}

std::optional<std::string> why_not(const SearchData& data, const Found& found, const JointFit& fit,
                                   const CrossValidation& before, const CrossValidation& after) {
  const Term& term = fit.model.terms.back();
  // Its own amplitude, and those of the effects before it, which it may push out.
  for (auto each = fit.model.terms.rbegin(); each != fit.model.terms.rend(); ++each) {
    if (!at_bound(fit, *each)) continue;
    return each->same_way(term)
               ? fmt::format("{} would leave its physical bounds", term.label())
               : fmt::format("with {}, {} would leave its physical bounds", term.label(), each->label());
  }
  if (is_told_by_one_block(before, after)) return fmt::format("{} is told by one block alone", term.label());
  const LossDifference gain = compare(before, after);
  if (!(gain.mean > gain.standard_error))
    return fmt::format("{} does not predict unseen blocks", term.label());
  if (lacks_speed_squared(data, found, term))
    return fmt::format("{} without rotor_speed is no way of the speed", term.label());
  if (const auto shared = only_bends(data, found, term, fit.variances, after))
    return fmt::format("{} is no more than a bend over {}", term.label(), *shared);
  if (is_shown_by_one_block(data, found, fit))
    return fmt::format("{} is shown by one block alone", term.label());
  if (const Term* other = cancelled_by_newest(data, fit))
    return fmt::format("{} and {} would cancel each other", term.label(), other->label());
  if (term.effect->has_change_point() && is_gradual(data, found.fit, {term}, fit.variances, after))
    return fmt::format("{} is no better than a gradual change", term.label());
  return std::nullopt;
}

std::optional<BeyondBounds> beyond_bounds(const SearchData& data, const JointFit& base, Term way,
                                          double start) {
  constexpr double kWidths = 10;
  const EffectParameter& bounded = way.effect->parameters[0];
  Effect freed = *way.effect;
  freed.parameters[0].lower -= kWidths * (bounded.upper - bounded.lower);
  freed.parameters[0].upper += kWidths * (bounded.upper - bounded.lower);
  MeanModel model = base.model;
  model.terms.push_back(way);
  model.terms.back().effect = &freed;
  model.terms.back().parameters[0] = start;
  const double amplitude =
      fit_jointly(data.observations(), model, data.rows()).model.terms.back().parameters[0];
  if (!(amplitude < bounded.lower || amplitude > bounded.upper)) return std::nullopt;
  return BeyondBounds{std::move(way), amplitude};
}

}  // namespace tunnelrig
