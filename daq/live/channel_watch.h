// What is wrong with a channel, seen in its frames alone, second by second.
#pragma once

#include "daq/live/frame_ring.h"
#include "datasets/run_statistics.h"

#include <array>
#include <cstdint>

namespace tunnelrig {

/// One channel over the last whole second, in counts.
struct ChannelSecond {
  double mean = 0, std = 0;
  std::int16_t low = 0, high = 0;
  std::uint64_t clipped = 0;  // samples at an end of the converter's range

  bool stuck() const { return low == high; }
  bool dead() const { return !stuck() && std < kDeadNoise_counts; }
};

class ChannelWatch {
 public:
  /// `second` in frames; `highest_count` and 0 are the clipped codes.
  ChannelWatch(std::size_t second, int highest_count) : second_(second), highest_(highest_count) {}

  void add(const LiveFrame& frame);

  /// False until a first second has passed.
  bool ready() const { return ready_; }
  const std::array<ChannelSecond, 4>& channels() const { return last_; }

 private:
  struct Sums {
    std::int64_t sum = 0, square = 0;
    std::int16_t low = 0, high = 0;
    std::uint64_t clipped = 0;
  };

  std::size_t second_;
  int highest_;
  std::size_t count_ = 0;
  std::array<Sums, 4> sums_{};
  std::array<ChannelSecond, 4> last_{};
  bool ready_ = false;
};

}  // namespace tunnelrig
