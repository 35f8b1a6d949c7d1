// Where a step lies, and what is profiled like it.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/shape_profile.h"
#include "analysis/residual/search/step_profile.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tunnelrig {

MeanModel with_change_points_of_all(Observations& observations, MeanModel model,
                                    std::vector<Profiled>& result) {
  const std::vector<int> rows = observations.all_rows();
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const auto k = model.terms[t].effect->change_point();
    if (!k) continue;
    const std::vector<int> sought = rows_where_a_step_may_begin(observations, rows);
    const StepProfile profile = step_profile(observations, model, t, rows, sought);
    if (profile.empty()) continue;
    int low = profile.lowest(), high = profile.highest();
    if (low == sought.front() || high == sought.back()) {  // it may lie where none is sought
      const StepProfile anywhere =
          step_profile(observations, model, t, rows, rows_where_a_step_may_lie(observations, rows));
      low = std::min(low, anywhere.lowest());
      high = std::max(high, anywhere.highest());
    }
    if (model.terms[t].per_group && profile.likeliest() != first_row_of(model.terms[t]))
      model = fit_with_parameter(*k, profile.likeliest(), observations, std::move(model), t, rows).model;
    model.terms[t].parameters[*k] = profile.likeliest();
    result.push_back({t, *k, static_cast<double>(low), static_cast<double>(high)});
  }
  return model;
}

MeanModel with_group_shapes_of_all(Observations& observations, MeanModel model,
                                   std::vector<Profiled>& result) {
  const std::vector<int> rows = observations.all_rows();
  for (std::size_t t = 0; t < model.terms.size(); ++t)
    for (const std::size_t k : shapes_in_groups(model.terms[t])) {
      const ShapeProfile profile =
          shape_profile(observations, fit_in_turns(observations, model, rows), t, k, rows);
      model = fit_with_parameter(k, profile.likeliest, observations, std::move(model), t, rows).model;
      result.push_back({t, k, profile.low, profile.high});
    }
  return model;
}

std::vector<int> astride_of_steps(const MeanModel& model, const Seal& seal) {
  std::vector<int> astride;
  for (const Term& term : model.terms) {
    if (!term.effect->has_change_point()) continue;
    const int behind = first_row_of(term);
    const auto first = std::lower_bound(seal.open.begin(), seal.open.end(), behind);
    const int last = first == seal.open.begin() ? -1 : *std::prev(first);
    std::copy_if(seal.sealed.begin(), seal.sealed.end(), std::back_inserter(astride),
                 [&](int row) { return row > last && row < behind; });
  }
  std::sort(astride.begin(), astride.end());
  astride.erase(std::unique(astride.begin(), astride.end()), astride.end());
  return astride.size() < seal.sealed.size() ? astride : std::vector<int>();
}

}  // namespace tunnelrig
