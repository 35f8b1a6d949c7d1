#include "analysis/residual/likelihood/candidates.h"

#include "analysis/residual/observations/condition_values.h"

#include <algorithm>
#include <map>

namespace tunnelrig {
namespace {

/// Of rising numbers of rows, those with a group that has rows before and from there on: a step between
/// groups is their difference.
std::vector<double> within_a_group(const Observations& observations, const std::vector<int>& rows,
                                   const std::vector<double>& points) {
  const std::map<int, std::vector<int>> of_groups = rows_of_each(observations.group, rows);
  std::vector<double> result;
  auto next = rows.begin();
  int last = -1;  // row of any group that has rows before the point
  for (const double point : points) {
    for (; next != rows.end() && *next < point; ++next)
      last = std::max(last, of_groups.at(observations.group[static_cast<std::size_t>(*next)]).back());
    if (last >= point) result.push_back(point);
  }
  return result;
}

/// Run numbers at which a change-point leaves enough blocks of `rows` on both sides: the first run of each
/// block, where a group goes on. Of a long table some, evenly spread: a step that is found is placed after.
std::vector<double> change_points(const Observations& observations, const std::vector<int>& rows) {
  std::vector<int> blocks;
  std::vector<double> first;
  for (const int row : rows) {
    const int block = observations.block[static_cast<std::size_t>(row)];
    if (blocks.empty() || blocks.back() != block) {
      blocks.push_back(block);
      first.push_back(row);
    }
  }
  if (static_cast<int>(blocks.size()) < 2 * kLeastBlocksBesideAStep) return {};
  std::vector<double> points{first.begin() + kLeastBlocksBesideAStep,
                             first.end() - kLeastBlocksBesideAStep + 1};
  const double least = kLeastShareBesideAStep * static_cast<double>(rows.size());
  std::erase_if(points, [&](double point) {
    const auto before = static_cast<double>(std::ranges::lower_bound(rows, point) - rows.begin());
    return before < least || static_cast<double>(rows.size()) - before < least;
  });
  points = within_a_group(observations, rows, points);
  constexpr std::size_t kMost = 300;
  const std::size_t every = std::max<std::size_t>(1, (points.size() + kMost - 1) / kMost);
  std::vector<double> some;
  for (std::size_t k = every / 2; k < points.size(); k += every) some.push_back(points[k]);
  return some;
}

}  // namespace

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
