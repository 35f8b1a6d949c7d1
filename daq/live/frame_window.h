// The newest frames without a gap, for a spectrum.
#pragma once

#include "daq/live/frame_ring.h"

#include <deque>

namespace tunnelrig {

/// The last `most` frames of one run; a jump of the index begins anew.
class FrameWindow {
 public:
  explicit FrameWindow(std::size_t most) : most_(most) {}

  void add(const LiveFrame& frame) {
    if (!frames_.empty() && frame.index != frames_.back().index + 1) frames_.clear();
    frames_.push_back(frame);
    if (frames_.size() > most_) frames_.pop_front();
  }

  bool full() const { return frames_.size() == most_; }
  const std::deque<LiveFrame>& frames() const { return frames_; }

 private:
  std::size_t most_;
  std::deque<LiveFrame> frames_;
};

}  // namespace tunnelrig
