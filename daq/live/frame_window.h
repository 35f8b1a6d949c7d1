// The newest frames without a longer gap, for a spectrum.
#pragma once

#include "daq/live/frame_ring.h"

#include <deque>

namespace tunnelrig {

/// The last `most` frames of one run. Where up to kBridged frames are missing, the last one before them is
/// held, so that a spectrum can be shown while some are lost; a longer gap begins anew.
class FrameWindow {
 public:
  explicit FrameWindow(std::size_t most) : most_(most) {}

  static constexpr std::uint64_t kBridged = 64;

  void add(const LiveFrame& frame) {
    if (!frames_.empty() && frame.index > frames_.back().index + 1 + kBridged) frames_.clear();
    while (!frames_.empty() && frame.index > frames_.back().index + 1) {
      LiveFrame held = frames_.back();
      ++held.index;
      push(held);
    }
    push(frame);
  }

  bool full() const { return frames_.size() == most_; }
  const std::deque<LiveFrame>& frames() const { return frames_; }

 private:
  void push(const LiveFrame& frame) {
    frames_.push_back(frame);
    if (frames_.size() > most_) frames_.pop_front();
  }

  std::size_t most_;
  std::deque<LiveFrame> frames_;
};

}  // namespace tunnelrig
