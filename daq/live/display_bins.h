// What a screen shows of the frames: lowest and highest of short intervals, so that no peak hides.
#pragma once

#include "daq/live/frame_ring.h"

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

namespace tunnelrig {

/// Consecutive intervals of time, in counts.
struct BinRange {
  struct Bin {
    bool empty = true;  // no frame of it came: a gap
    std::array<std::int16_t, 4> low{}, high{};
  };
  std::uint64_t first = 0;  // number of the first bin, from the run's start
  std::vector<Bin> bins;
};

/// Sorts one run's frames into bins of equal length. A bin is handed out once a later frame has come, so that
/// every bin is handed out once and whole. Memory is bounded: what nobody takes is dropped, oldest first.
class DisplayBins {
 public:
  /// `frames_per_bin` need not be whole; at least 1.
  explicit DisplayBins(double frames_per_bin) : frames_per_bin_(frames_per_bin) {}

  /// Frames must ascend.
  void add(const LiveFrame& frame);

  /// Complete bins since the last call, at most kMostBins; `all`: the last, open one too. Behind a longer gap
  /// only what came after it is handed out: the numbers of the bins show the gap.
  BinRange take(bool all = false);

  void clear() { bins_.clear(); }

  static constexpr std::size_t kMostBins = 1024;

 private:
  struct Numbered {
    std::uint64_t number = 0;
    BinRange::Bin bin;
  };

  double frames_per_bin_;
  std::deque<Numbered> bins_;  // those that hold frames, in order; the last one is open
};

}  // namespace tunnelrig
