// Which blocks nobody looks at until the end.
#pragma once

#include "analysis/residual/observations/observations.h"

#include <cstdint>
#include <vector>

namespace tunnelrig {

struct Seal {
  std::vector<int> open, sealed;         // runs
  std::vector<std::string> only_sealed;  // groups without an open run: they cannot be scored
};

/// A quarter of the blocks, one of every four neighbours in time, so that every group keeps an open run where
/// possible. A table's hold_out rows instead, where it has them. Reproducible for a seed.
Seal seal_blocks(const Observations& observations, std::uint64_t seed);

/// Whether anything predicts one of these sealed rows: another run of its location, or where the block is the
/// group the rest of it.
bool can_be_scored(const Observations& observations, const Seal& seal, const std::vector<int>& rows);

}  // namespace tunnelrig
