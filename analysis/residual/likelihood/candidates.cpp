#include "analysis/residual/likelihood/candidates.h"

#include "analysis/residual/observations/condition_values.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace tunnelrig {
namespace {

/// How many rows from `first` on have enough blocks among them; one more than there are: too few.
template <class Iterator>
std::size_t rows_of_enough_blocks(const Observations& observations, Iterator first, Iterator last) {
  std::set<int> blocks;
  std::size_t passed = 0;
  for (auto row = first; row != last; ++row) {
    blocks.insert(observations.block[static_cast<std::size_t>(*row)]);
    ++passed;
    if (blocks.size() == kLeastBlocksBesideAStep) return passed;
  }
  return passed + 1;
}

/// For each place in `rows`, the runs before and from there on of the groups that have some on both sides,
/// the fewer of the two: a step between groups is their difference, and no group tells it by a run or two.
std::vector<int> runs_beside(const Observations& observations, const std::vector<int>& rows) {
  std::map<int, int> of_group, passed;
  for (const int row : rows) ++of_group[observations.group[static_cast<std::size_t>(row)]];
  int before = 0, after = 0;
  std::vector<int> result;
  for (const int row : rows) {
    result.push_back(std::min(before, after));
    const int group = observations.group[static_cast<std::size_t>(row)];
    const int all = of_group[group], had = passed[group]++;
    before += had + 1 == all ? -had : 1;
    after += had == 0 ? all - 1 : -1;
  }
  return result;
}

/// Run numbers at which a step is tried: where a block begins. Of a long table some, evenly spread: a step
/// that is found is placed after.
std::vector<double> change_points(const Observations& observations, const std::vector<int>& rows) {
  std::vector<double> points;
  for (const int row : rows_where_a_step_may_begin(observations, rows)) {
    const auto place = std::ranges::lower_bound(rows, row);
    if (observations.block[static_cast<std::size_t>(row)] !=
        observations.block[static_cast<std::size_t>(*(place - 1))])
      points.push_back(row);
  }
  constexpr std::size_t kMost = 300;
  const std::size_t every = std::max<std::size_t>(1, (points.size() + kMost - 1) / kMost);
  std::vector<double> some;
  for (std::size_t k = every / 2; k < points.size(); k += every) some.push_back(points[k]);
  return some;
}

}  // namespace

std::vector<int> rows_where_a_step_may_begin(const Observations& observations, const std::vector<int>& rows) {
  const auto share =
      static_cast<std::size_t>(std::ceil(kLeastShareBesideAStep * static_cast<double>(rows.size())));
  const std::size_t before = std::max(share, rows_of_enough_blocks(observations, rows.begin(), rows.end()));
  const std::size_t after = std::max(share, rows_of_enough_blocks(observations, rows.rbegin(), rows.rend()));
  const std::vector<int> beside = runs_beside(observations, rows);
  std::vector<int> result;
  for (std::size_t place = before; place + after <= rows.size(); ++place)
    if (beside[place] >= kLeastRunsBesideAStep) result.push_back(rows[place]);
  return result;
}

std::vector<int> rows_where_a_step_may_lie(const Observations& observations, const std::vector<int>& rows) {
  const std::vector<int> beside = runs_beside(observations, rows);
  std::vector<int> result;
  for (std::size_t place = 0; place < rows.size(); ++place)
    if (beside[place] > 0) result.push_back(rows[place]);
  return result;
}

std::vector<Term> ways_to_try(const Effect& effect, const Observations& observations,
                              const std::vector<int>& rows) {
  std::vector<Term> ways = {
      {.effect = &effect, .parameters = std::vector<double>(effect.parameters.size(), 0.0)}};
  const int channels = static_cast<int>(observations.channels());
  if (effect.scope == EffectScope::kRotor && channels > 1) {
    for (int rotor = 0; rotor < channels; ++rotor) {
      ways.push_back(ways[0]);
      ways.back().rotor = rotor;
    }
  }
  if (effect.scope == EffectScope::kPair) {
    const Term blank = ways[0];
    ways.clear();
    for (int to = 0; to < channels; ++to)
      for (int from = 0; from < channels; ++from) {
        if (to == from) continue;
        ways.push_back(blank);
        ways.back().rotor = to;
        ways.back().other = from;
      }
  }
  for (std::size_t k = 1; k < effect.parameters.size(); ++k) {
    const std::vector<double> grid = effect.parameters[k].role == ParameterRole::kChangePoint
                                         ? change_points(observations, rows)
                                         : effect.parameters[k].grid;
    std::vector<Term> shaped;
    for (const Term& way : ways)
      for (const double value : grid) {
        shaped.push_back(way);
        shaped.back().parameters[k] = value;
      }
    ways = std::move(shaped);
  }
  return ways;
}

}  // namespace tunnelrig
