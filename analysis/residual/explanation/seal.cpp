#include "analysis/residual/explanation/seal.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <random>
#include <set>

namespace tunnelrig {
namespace {

/// Groups that would have no open run if these blocks were sealed.
std::set<int> orphans(const Observations& observations, const std::set<int>& sealed) {
  std::set<int> groups, open;
  for (std::size_t row = 0; row < observations.group.size(); ++row) {
    groups.insert(observations.group[row]);
    if (!sealed.contains(observations.block[row])) open.insert(observations.group[row]);
  }
  std::set<int> result;
  std::set_difference(groups.begin(), groups.end(), open.begin(), open.end(),
                      std::inserter(result, result.end()));
  return result;
}

std::set<int> choose(const Observations& observations, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const int blocks = observations.blocks();
  const int wanted = std::max(1, (blocks + 2) / 4);
  std::set<int> sealed;
  for (int s = 0; s < wanted; ++s) {
    const auto first_of = [&](std::int64_t part) { return static_cast<int>(part * blocks / wanted); };
    std::vector<int> neighbours(static_cast<std::size_t>(first_of(s + 1) - first_of(s)));
    std::iota(neighbours.begin(), neighbours.end(), first_of(s));
    std::shuffle(neighbours.begin(), neighbours.end(), random);
    // Groups that lie within blocks would all be orphans: then any block is as good as another.
    const auto lost = [&](int block) {
      std::set<int> tried = sealed;
      tried.insert(block);
      return observations.groups_within_blocks ? 0 : orphans(observations, tried).size();
    };
    const bool many = observations.blocks() > 100;  // rows as blocks: a group has others
    sealed.insert(many ? neighbours[0]
                       : *std::min_element(neighbours.begin(), neighbours.end(),
                                           [&](int a, int b) { return lost(a) < lost(b); }));
  }
  return sealed;
}

}  // namespace

Seal seal_blocks(const Observations& observations, std::uint64_t seed) {
  Seal seal;
  const bool declared = !observations.held_out.empty();
  const std::set<int> blocks = declared ? std::set<int>() : choose(observations, seed);
  std::set<int> open_groups, sealed_groups;
  for (std::size_t row = 0; row < observations.block.size(); ++row) {
    const bool sealed = declared ? observations.held_out[row] : blocks.contains(observations.block[row]);
    (sealed ? seal.sealed : seal.open).push_back(static_cast<int>(row));
    (sealed ? sealed_groups : open_groups).insert(observations.group[row]);
  }
  for (const int group : sealed_groups)
    if (!open_groups.contains(group))
      seal.only_sealed.push_back(observations.group_name[static_cast<std::size_t>(group)]);
  return seal;
}

bool can_be_scored(const Observations& observations, const Seal& seal, const std::vector<int>& rows) {
  const auto open = places_of_each(observations.group, seal.open);
  return std::ranges::any_of(rows, [&](int row) {
    return observations.groups_within_blocks ||
           open.contains(observations.group[static_cast<std::size_t>(row)]);
  });
}

}  // namespace tunnelrig
