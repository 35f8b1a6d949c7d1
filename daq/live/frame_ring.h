// The hand-over from the recording thread to whoever watches: bounded, and the recorder never waits at it.
#pragma once

#include "datasets/raw_store.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

namespace tunnelrig {

/// A frame as it was recorded. `index` counts from the run's first frame, lost ones included: where it jumps,
/// frames are missing (lost on the way to the computer, or dropped from the display here).
struct LiveFrame {
  std::uint64_t index = 0;
  std::uint32_t run = 0;  // how many runs the ring has seen begin
  std::array<std::int16_t, 4> counts{};
};

/// A ring for one writing and one reading thread, without locks. Where the reader falls behind, frames are
/// dropped and counted: what is stored never depends on what is shown.
class FrameRing : public FrameSink {
 public:
  /// Room for at least `frames` frames; 24 bytes each.
  explicit FrameRing(std::size_t frames);

  // --- the recording thread

  void begin_run();
  void frames(std::span<const std::byte> data) override;  // int16 × 4
  void gap(const Gap& gap) override;

  // --- the watching thread

  /// Appends what has come to `frames`.
  void take(std::vector<LiveFrame>& frames);

  // --- any thread

  /// Number of runs begun: frames of an earlier one are history.
  std::uint32_t run() const { return run_.load(std::memory_order_relaxed); }
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::vector<LiveFrame> slots_;  // a power of two
  std::size_t mask_;
  std::atomic<std::uint64_t> written_{0}, read_{0};  // each advanced by one thread only
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint32_t> run_{0};
  std::uint64_t index_ = 0;  // of the next frame; the writer's
};

}  // namespace tunnelrig
