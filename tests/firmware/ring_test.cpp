// The ring: every interleaving of a short history, and a long one with real threads (under ThreadSanitizer).
#include "ring.h"

#include "ring_interleavings.h"

#include <array>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <ucontext.h>

namespace {

ring_slot slot_of(uint32_t number) {
  ring_slot slot{};
  slot.sequence = number;
  for (int16_t& sample : slot.frame.sample) sample = static_cast<int16_t>(number * 3);
  slot.frame.status = static_cast<uint16_t>(number);
  return slot;
}

bool whole(const ring_slot& slot) {
  return slot.frame.status == static_cast<uint16_t>(slot.sequence) &&
         slot.frame.sample[3] == static_cast<int16_t>(slot.sequence * 3);
}

TEST(Ring, FillsToTheLastSlotAndWrapsItsIndices) {
  std::array<ring_slot, 4> slots{};
  frame_ring ring;
  ring_init(&ring, slots.data(), 4);
  ring.head = ring.tail = 0xFFFFFFFEu;
  for (uint32_t i = 0; i < 4; ++i) {
    const ring_slot slot = slot_of(i);
    EXPECT_TRUE(ring_push(&ring, &slot));
  }
  const ring_slot fifth = slot_of(4);
  EXPECT_FALSE(ring_push(&ring, &fifth));
  EXPECT_EQ(ring_count(&ring), 4u);
  EXPECT_EQ(ring_at(&ring, 3)->sequence, 3u);
  ring_release(&ring, 2);
  EXPECT_TRUE(ring_push(&ring, &fifth));
  EXPECT_EQ(ring_at(&ring, 0)->sequence, 2u);
  ring_drop_until(&ring, ring_head(&ring));
  EXPECT_EQ(ring_count(&ring), 0u);
  ring_drop_until(&ring, ring_head(&ring) - 3);
  EXPECT_EQ(ring_count(&ring), 0u) << "never backwards";
}

/// Two coroutines whose every step on shared memory is a point where the other may go on; all orders are
/// tried.
class Interleavings {
 public:
  Interleavings(std::function<void()> first, std::function<void()> second)
      : bodies_{std::move(first), std::move(second)} {}

  /// Runs `prepare`, both bodies, `check`, once per order; how many there are.
  std::size_t explore(const std::function<void()>& prepare, const std::function<void()>& check) {
    std::size_t orders = 0;
    do {
      prepare();
      run();
      check();
      ++orders;
    } while (next_order());
    return orders;
  }

 private:
  struct Choice {
    int taken;
    bool both;  // there was one
  };

  static void entry(int which) {
    current_->bodies_[static_cast<std::size_t>(which)]();
    current_->done_[static_cast<std::size_t>(which)] = true;
  }

  static void step() {
    const int which = current_->running_;
    swapcontext(&current_->contexts_[static_cast<std::size_t>(which)], &current_->scheduler_);
  }

  void run() {
    current_ = this;
    interleaved_step = step;
    done_ = {};
    for (int which = 0; which < 2; ++which) {
      auto& context = contexts_[static_cast<std::size_t>(which)];
      getcontext(&context);
      context.uc_stack.ss_sp = stacks_[static_cast<std::size_t>(which)].data();
      context.uc_stack.ss_size = stacks_[static_cast<std::size_t>(which)].size();
      context.uc_link = &scheduler_;
      makecontext(&context, reinterpret_cast<void (*)()>(entry), 1, which);
    }
    for (std::size_t at = 0; !done_[0] || !done_[1]; ++at) {
      if (at == choices_.size()) choices_.push_back({done_[0] ? 1 : 0, !done_[0] && !done_[1]});
      running_ = choices_[at].taken;
      swapcontext(&scheduler_, &contexts_[static_cast<std::size_t>(running_)]);
    }
  }

  /// Depth first: the last choice that had another way takes it.
  bool next_order() {
    while (!choices_.empty() && (!choices_.back().both || choices_.back().taken == 1)) choices_.pop_back();
    if (choices_.empty()) return false;
    choices_.back().taken = 1;
    return true;
  }

  inline static Interleavings* current_ = nullptr;
  std::array<std::function<void()>, 2> bodies_;
  std::array<bool, 2> done_{};
  std::array<ucontext_t, 2> contexts_{};
  ucontext_t scheduler_{};
  std::array<std::vector<char>, 2> stacks_{std::vector<char>(65536), std::vector<char>(65536)};
  std::vector<Choice> choices_;
  int running_ = 0;
};

TEST(Ring, EveryInterleavingKeepsOrderAndLosesOnlyWhatItRefused) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizers do not follow swapcontext";
#endif
  std::array<ring_slot, 2> slots{};
  frame_ring ring;
  std::vector<uint32_t> accepted, seen;
  bool torn = false, refused_once = false;
  const auto produce = [&] {
    for (uint32_t number = 1; number <= 3; ++number) {
      const ring_slot slot = slot_of(number);
      if (interleaved_push(&ring, &slot)) {
        accepted.push_back(number);
      } else {
        refused_once = true;
      }
    }
  };
  const auto take = [&] {
    ring_slot slot{};
    interleaved_read(&ring, &slot);
    torn |= !whole(slot);
    seen.push_back(slot.sequence);
    interleaved_release(&ring, 1);
  };
  const auto consume = [&] {
    for (int look = 0; look < 2; ++look) {
      if (interleaved_count(&ring) > 0) take();
    }
  };
  Interleavings all(produce, consume);
  std::size_t failures = 0;
  const std::size_t orders = all.explore(
      [&] {
        interleaved_init(&ring, slots.data(), 2);
        ring.head = ring.tail = 0xFFFFFFFFu;  // the indices wrap on the way
        accepted.clear();
        seen.clear();
      },
      [&] {
        interleaved_step = [] {};
        while (interleaved_count(&ring) > 0) take();
        if (torn || seen != accepted) ++failures;
      });
  EXPECT_EQ(failures, 0u);
  EXPECT_GT(orders, 10000u);
  EXPECT_TRUE(refused_once) << "the full ring was never met";
  RecordProperty("orders", static_cast<int>(orders));
}

TEST(Ring, TwoThreadsAgree) {
  std::vector<ring_slot> slots(64);
  frame_ring ring;
  ring_init(&ring, slots.data(), 64);
  constexpr uint32_t kFrames = 300000;
  uint32_t refused = 0;
  std::thread producer([&] {
    for (uint32_t number = 0; number < kFrames;) {
      const ring_slot slot = slot_of(number);
      if (ring_push(&ring, &slot)) {
        ++number;
      } else {
        ++refused;
        std::this_thread::yield();
      }
    }
  });
  uint32_t next = 0, wrong = 0;
  while (next < kFrames) {
    const uint32_t count = ring_count(&ring);
    for (uint32_t i = 0; i < count; ++i, ++next) {
      const ring_slot& slot = *ring_at(&ring, i);
      if (slot.sequence != next || !whole(slot)) ++wrong;
    }
    ring_release(&ring, count);
    if (count == 0) std::this_thread::yield();
  }
  producer.join();
  EXPECT_EQ(wrong, 0u);
}

}  // namespace
