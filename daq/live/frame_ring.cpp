#include "daq/live/frame_ring.h"

#include <bit>
#include <cstring>

namespace tunnelrig {

FrameRing::FrameRing(std::size_t frames) : slots_(std::bit_ceil(frames)), mask_(slots_.size() - 1) {}

void FrameRing::begin_run() {
  run_.fetch_add(1, std::memory_order_relaxed);
  index_ = 0;
}

void FrameRing::frames(std::span<const std::byte> data) {
  constexpr std::size_t kFrame = sizeof(LiveFrame::counts);
  const std::size_t count = data.size() / kFrame;
  const std::uint64_t written = written_.load(std::memory_order_relaxed);
  const std::uint64_t room = slots_.size() - (written - read_.load(std::memory_order_acquire));
  const std::size_t kept = std::min<std::uint64_t>(count, room);
  const std::uint32_t run = run_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < kept; ++i) {
    LiveFrame& slot = slots_[(written + i) & mask_];
    slot.index = index_ + i;
    slot.run = run;
    std::memcpy(slot.counts.data(), data.data() + i * kFrame, kFrame);
  }
  index_ += count;
  written_.store(written + kept, std::memory_order_release);
  if (kept < count) dropped_.fetch_add(count - kept, std::memory_order_relaxed);
}

void FrameRing::gap(const Gap& gap) { index_ += gap.frames_lost; }

void FrameRing::take(std::vector<LiveFrame>& frames) {
  const std::uint64_t read = read_.load(std::memory_order_relaxed);
  const std::uint64_t written = written_.load(std::memory_order_acquire);
  for (std::uint64_t i = read; i < written; ++i) frames.push_back(slots_[i & mask_]);
  read_.store(written, std::memory_order_release);
}

}  // namespace tunnelrig
