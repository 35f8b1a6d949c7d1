// Block means of a run under way, in bounded memory: what says how well its mean is known so far.
#pragma once

#include "daq/live/frame_ring.h"

#include <array>
#include <cstdint>
#include <vector>

namespace tunnelrig {

/// Means of consecutive blocks of frames, four channels, in counts. When there are kMostBlocks of them,
/// neighbours are merged in pairs and blocks are twice as long from then on: the mean is the same, and its
/// error by autocorrelation hardly changes as long as blocks are many.
class RunningBlocks {
 public:
  using Values = std::array<double, 4>;

  explicit RunningBlocks(std::size_t frames_per_block) : frames_per_block_(frames_per_block) {}

  /// Frames must ascend; a block that a gap cut below half its length is left out of the series.
  void add(const LiveFrame& frame);

  std::uint64_t frames() const { return frames_; }
  Values mean() const;  // of all frames
  const std::vector<Values>& blocks() const { return blocks_; }
  std::size_t frames_per_block() const { return frames_per_block_; }

  static constexpr std::size_t kMostBlocks = 2048;

 private:
  void close();
  void merge();

  std::size_t frames_per_block_;
  std::vector<Values> blocks_;
  std::uint64_t block_ = 0;  // number of the open one
  std::array<std::int64_t, 4> sums_{}, all_{};
  std::size_t count_ = 0;
  std::uint64_t frames_ = 0;
};

}  // namespace tunnelrig
