#include "analysis/residual/search/best_run.h"

#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/step_profile.h"

#include <utility>

namespace tunnelrig {

Placed at_best_run(const Observations& observations, JointFit fit, std::size_t from_newest,
                   const std::vector<int>& rows) {
  const std::size_t t = fit.model.terms.size() - from_newest;
  const Term& step = fit.model.terms[t];
  if (!step.effect->has_change_point()) return {std::move(fit)};
  const StepProfile profile =
      step_profile(observations, fit.model, t, rows, rows_where_a_step_may_begin(observations, rows));
  if (profile.empty() || profile.likeliest() == first_row_of(step)) return {std::move(fit)};
  if (step.per_group) {
    Observations moved = observations;
    JointFit there = fit_with_parameter(step.effect->change_point().value(), profile.likeliest(), moved,
                                        fit.model, t, rows);
    if (likelihood_beside_own(moved, there.variances, rows) <=
        likelihood_beside_own(observations, fit.variances, rows))
      return {std::move(fit)};
    return {std::move(there), std::move(moved)};
  }
  MeanModel moved = fit.model;
  moved.terms[t].parameters[step.effect->change_point().value()] = profile.likeliest();
  JointFit there = fit_jointly(observations, moved, rows);
  return {there.variances.log_likelihood > fit.variances.log_likelihood ? std::move(there) : std::move(fit)};
}

}  // namespace tunnelrig
