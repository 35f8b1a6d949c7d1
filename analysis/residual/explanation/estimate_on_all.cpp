// Once the seal is open: what all runs say of what was found.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/likelihood/scores.h"

#include <algorithm>
#include <utility>

namespace tunnelrig {
namespace {

void report_adopted(const Observations& observations, const Attribution& found, const JointFit& whole,
                    const std::vector<int>& rows, Explanation& explanation) {
  const auto parameters = estimate_parameters(observations, whole, rows);
  for (std::size_t t = 0; t < found.accepted.size(); ++t) {
    const Accepted& accepted = found.accepted[t];
    AdoptedEffect adopted{.term = whole.model.terms[t],
                          .parameters = parameters[t],
                          .p_value = accepted.p,
                          .held_out_gain = accepted.gain,
                          .at_bound = at_bound(whole, accepted.term),
                          .confounded_with = {},
                          .separating_run = {}};
    if (adopted.term.per_group) {
      const EffectParameter& amplitude = adopted.term.effect->parameters[0];
      const auto groups = estimate_by_group(observations, whole.model, t, whole.variances, rows);
      adopted.parameters[0] = summary_of_groups(amplitude, groups);
      adopted.at_bound = !are_within_bounds(groups, amplitude);  // what joined it later may have moved them
    }
    for (std::size_t k = 0; k < adopted.parameters.size(); ++k)
      adopted.parameters[k].unit = unit_of(observations, *adopted.term.effect, k);
    for (const Ranked& rival : accepted.confounded)
      adopted.confounded_with.push_back(rival.term.effect->cause());
    if (!accepted.confounded.empty())
      adopted.separating_run =
          separating_run(observations, found.final, t, accepted.confounded[0].term, rows);
    explanation.adopted.push_back(std::move(adopted));
  }
}

/// Change-points as the runs are numbered, where the search counted rows; where they are counted anew in
/// each group, numbers do not say which row it is, and the rows are counted from 0.
void number_change_points(const Observations& observations, const std::vector<Profiled>& change_points,
                          Explanation& explanation) {
  const Covariate* order = observations.find("run_order");
  if (order == nullptr || !std::ranges::is_sorted(order->value.col(0))) return;
  for (const Profiled& point : change_points) {
    ParameterEstimate& estimate = explanation.adopted[point.term].parameters[point.parameter];
    for (double* place : {&estimate.value, &estimate.low, &estimate.high})
      *place = order->value(static_cast<Eigen::Index>(*place), 0);
  }
}

/// Names are settled, but a structure that the open blocks are too few for is one all the same, and so is
/// what they are too few to name.
void report_structure_left(const StructureLeft& left, const Observations& observations,
                           const std::vector<int>& rows, Explanation& explanation) {
  for (const std::size_t t : left.bent) explanation.adopted[t].bends_away = true;
  for (std::size_t c = 0; c < left.names.size(); ++c) explanation.unknown[c].could_be = left.names[c];
  for (const FoundCurve& curve : left.curves) {
    explanation.unknown.push_back(describe(observations, left.fit, curve, rows));
    explanation.unknown.back().by_sealed_too = true;
    explanation.by_sealed_too.push_back(curve.curve);
  }
  for (Round round : left.rounds) {
    round.outcome = "all blocks, the sealed ones too: " + round.outcome;
    explanation.curve_rounds.push_back(std::move(round));
  }
}

}  // namespace

void estimate_on_all(const Models& models, const Observations& observations,
                     const std::vector<const Effect*>& effects, const SearchSettings& settings,
                     Explanation& explanation) {
  const Fitted& baseline = models.baseline;
  Attribution found = models.found;
  Observations& wide = found.observations;
  const std::vector<int> rows = observations.all_rows();
  std::vector<Profiled> change_points, shapes;
  MeanModel model = with_change_points_of_all(wide, found.final.model, change_points);
  model = with_group_shapes_of_all(wide, std::move(model), shapes);
  const JointFit whole = fit_jointly(wide, model, rows);
  if (!whole.converged)
    explanation.warnings.emplace_back(
        "the effects could not be fitted together to all runs, since forces would change their sign: the "
        "parameters are those that the search had");
  else if (!whole.settled)
    explanation.warnings.emplace_back(
        "the effects are so large that their parameters and the forces that they act on have not settled in "
        "turns: a parameter may be off by more than a thousandth of itself");
  explanation.model = whole.model;
  explanation.scatter = wide.scatter;
  explanation.residual_before = residuals(baseline.data, fit_jointly(baseline.data, {}, rows), rows);
  const HeldOutErrors fitted = score(wide, whole, rows, rows);
  explanation.residual_after = fitted.error;
  const StructureLeft left = structure_left(found, whole, rows, effects, settings);
  for (std::size_t t = 0; t < left.confounded.size(); ++t) found.accepted[t].confounded = left.confounded[t];
  report_adopted(wide, found, whole, rows, explanation);
  for (const Profiled& shape : shapes) {
    ParameterEstimate& estimate = explanation.adopted[shape.term].parameters[shape.parameter];
    estimate.low = shape.low;
    estimate.high = shape.high;
  }
  for (const Profiled& point : change_points) {
    ParameterEstimate& estimate = explanation.adopted[point.term].parameters[point.parameter];
    estimate.low = point.low;
    estimate.high = point.high;
    estimate.run = observations.name[static_cast<std::size_t>(estimate.value)];
    constexpr double kMostOfTheCourse = 0.5;
    explanation.adopted[point.term].anywhere |=
        point.high - point.low > kMostOfTheCourse * static_cast<double>(rows.size());
  }
  warn_of_doubts(explanation);
  warn_of_blocks_of_their_own(wide, whole, rows, explanation);
  warn_of_noisy_speed(wide, predict_response(wide, whole.model, rows), explanation);
  for (const FoundCurve& curve : found.curves)
    explanation.unknown.push_back(describe(wide, whole, curve, rows));
  report_structure_left(left, wide, rows, explanation);
  if (found.session_unknown && explanation.unknown.empty())
    explanation.unknown.push_back(
        describe_sessions(observations, fitted.error, *found.session_unknown, rows));
  for (const SuspectRow& row :
       suspect_rows(wide, fitted, whole.variances, degrees_of_freedom(wide, whole, rows))) {
    const bool said = std::ranges::count(explanation.suspect_rows, row.row, &SuspectRow::row) > 0;
    if (!said && !is_beyond_a_curve(whole.model, place_of(wide, row.row)))
      explanation.suspect_rows.push_back(row);
  }
  found.of_one_block.insert(found.of_one_block.end(), left.of_one_block.begin(), left.of_one_block.end());
  warn_of_single_blocks(observations, found.of_one_block, explanation);
  warn_of_odd_blocks(observations, explanation);
  warn_of_alike_rows(observations, explanation);
  warn_of_tares(wide, whole.model, explanation);
  warn_of_changes_at_steps(observations, explanation);
  number_change_points(observations, change_points, explanation);
}

}  // namespace tunnelrig
