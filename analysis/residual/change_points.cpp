// Where a step lies.
#include "analysis/residual/explanation_parts.h"

#include <algorithm>
#include <iterator>

namespace tunnelrig {
namespace {

/// First runs of a step that was found at run `found`: those of its session, of the open ones on either side,
/// and of what lies between. Where blocks do not follow each other, the first rows of blocks since the open
/// row before.
std::vector<int> candidates(const Observations& observations, const std::vector<int>& open, int found) {
  const auto block = [&](int row) { return observations.block[static_cast<std::size_t>(row)]; };
  const auto at = std::lower_bound(open.begin(), open.end(), found);
  std::vector<int> result;
  if (!observations.blocks_follow_each_other()) {
    for (int row = at == open.begin() ? 1 : *std::prev(at) + 1; row <= found; ++row)
      if (block(row) != block(row - 1)) result.push_back(row);
    return result;
  }
  const auto elsewhere = [&](int row) { return block(row) != block(found); };
  const auto before = std::find_if(std::make_reverse_iterator(at), open.rend(), elsewhere);
  const auto behind = std::find_if(at, open.end(), elsewhere);
  const int first = before == open.rend() ? block(found) : block(*before),
            last = behind == open.end() ? block(found) : block(*behind);
  for (int row = 1; row < static_cast<int>(observations.rows()); ++row)
    if (block(row) >= first && block(row) <= last) result.push_back(row);
  return result;
}

}  // namespace

MeanModel with_change_points_of_all(const Observations& observations, MeanModel model,
                                    const std::vector<int>& open, std::vector<ChangePoint>& result) {
  constexpr double kHalfChiSquared = 1.92;  // 95 % of one degree of freedom, halved
  const std::vector<int> rows = observations.all_rows();
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const auto& parameters = model.terms[t].effect->parameters;
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      if (parameters[k].role != ParameterRole::kChangePoint) continue;
      const double found = model.terms[t].parameters[k];
      std::vector<std::pair<double, double>> likelihood;  // by first run
      for (const int row : candidates(observations, open, static_cast<int>(found))) {
        MeanModel moved = model;
        moved.terms[t].parameters[k] = row;
        likelihood.emplace_back(fit_jointly(observations, moved, rows).variances.log_likelihood, row);
      }
      if (likelihood.empty()) continue;
      const auto [highest, best] = *std::max_element(likelihood.begin(), likelihood.end());
      model.terms[t].parameters[k] = best;
      ChangePoint point{t, k, best, best};
      for (const auto& [value, row] : likelihood)
        if (value > highest - kHalfChiSquared) {
          point.low = std::min(point.low, row);
          point.high = std::max(point.high, row);
        }
      result.push_back(point);
    }
  }
  return model;
}

std::vector<int> astride_of_steps(const MeanModel& model, const Seal& seal) {
  std::vector<int> astride;
  for (const Term& term : model.terms)
    for (std::size_t k = 0; k < term.parameters.size(); ++k) {
      if (term.effect->parameters[k].role != ParameterRole::kChangePoint) continue;
      const int behind = static_cast<int>(term.parameters[k]);
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
