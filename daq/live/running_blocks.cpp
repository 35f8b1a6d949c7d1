#include "daq/live/running_blocks.h"

namespace tunnelrig {

void RunningBlocks::add(const LiveFrame& frame) {
  const std::uint64_t block = frame.index / frames_per_block_;
  if (block != block_) {
    close();
    block_ = frame.index / frames_per_block_;  // blocks may have become longer
  }
  for (std::size_t c = 0; c < sums_.size(); ++c) sums_[c] += frame.counts[c];
  ++count_;
}

void RunningBlocks::close() {
  if (2 * count_ >= frames_per_block_) {
    Values means{};
    for (std::size_t c = 0; c < means.size(); ++c)
      means[c] = static_cast<double>(sums_[c]) / static_cast<double>(count_);
    blocks_.push_back(means);
  }
  for (std::size_t c = 0; c < all_.size(); ++c) all_[c] += sums_[c];
  frames_ += count_;
  sums_ = {};
  count_ = 0;
  if (blocks_.size() >= kMostBlocks) merge();
}

void RunningBlocks::merge() {
  for (std::size_t i = 0; i + 1 < blocks_.size(); i += 2) {
    for (std::size_t c = 0; c < 4; ++c) blocks_[i / 2][c] = (blocks_[i][c] + blocks_[i + 1][c]) / 2;
  }
  blocks_.resize(blocks_.size() / 2);
  frames_per_block_ *= 2;
}

RunningBlocks::Values RunningBlocks::mean() const {
  Values mean{};
  const auto count = static_cast<double>(frames_ + count_);
  for (std::size_t c = 0; c < mean.size() && count > 0; ++c)
    mean[c] = static_cast<double>(all_[c] + sums_[c]) / count;
  return mean;
}

}  // namespace tunnelrig
