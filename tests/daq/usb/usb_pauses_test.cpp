// What happens to the board while nobody records, and what of it must not get into the next run.
#include "rig.h"

#include <atomic>
#include <thread>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using namespace std::chrono_literals;
using simulated::Pace;
using test::expect_every_frame_in_its_place;
using test::log_usb;
using test::Logged;
using test::Rig;

/// Records a run; it begins with the first frame of a board that was started for it.
void expect_a_run_of_its_own(PacketSource& source, Rig& rig) {
  const std::uint32_t starts = rig.board.starts;  // which the bus does not move by itself
  const Logged logged = log_usb(source, 0.2);
  EXPECT_EQ(logged.outcome.state, RunState::kComplete);
  EXPECT_EQ(logged.outcome.ledger.frames_lost, 0u);
  EXPECT_EQ(logged.outcome.ledger.bytes_skipped, 0u);
  rig.bus.with_board([&](simulated::Board& board) {
    EXPECT_GT(board.starts, starts);
    EXPECT_EQ(logged.outcome.ledger.boot_id, board.core.identity.boot_id);
    EXPECT_EQ(logged.outcome.ledger.first_sequence, board.core.origin_sequence);
  });
  expect_every_frame_in_its_place(logged);
}

TEST(Usb, ACablePulledInThePauseLeavesNothingForTheNextRun) {
  for (const bool waits : {false, true}) {         // for a person, or goes on at once
    for (const bool own_supply : {false, true}) {  // the board's, or the bus feeds it
      Rig rig(Pace::kRig);
      const auto source = open_source("usb");
      log_usb(*source, 0.2);
      const auto pause = [&] {
        for (int i = 0; i < 3; ++i) {
          if (waits) source->idle();
          std::this_thread::sleep_for(100ms);
        }
      };
      pause();
      rig.bus.unplug();
      if (!own_supply) rig.bus.with_board([](simulated::Board& board) { board.power_cycle(); });
      rig.bus.plug();
      pause();
      expect_a_run_of_its_own(*source, rig);
    }
  }
}

TEST(Usb, AStopThatIsNotAnsweredBeginsTheRunAllTheSame) {
  Rig rig(Pace::kRig);
  const auto source = open_source("usb");
  std::this_thread::sleep_for(100ms);
  rig.bus.set_deaf(true);
  std::thread troublemaker([&] {
    // Longer than *stop* is waited for, and until the device is given up: it has to be closed later.
    std::this_thread::sleep_for(700ms);
    rig.bus.set_deaf(false);
  });
  expect_a_run_of_its_own(*source, rig);
  troublemaker.join();
}

TEST(Usb, FramesStillOnTheirWayAtAStartAreKnownByTheirNumbers) {
  Rig rig(Pace::kRig);
  const auto source = open_source("usb");
  std::vector<std::uint8_t> held;
  bool holding = true;
  const std::uint32_t starts = rig.board.starts;
  rig.bus.set_mangle([&](const std::uint8_t* data, std::size_t size, std::vector<std::uint8_t>& out) {
    holding = holding && rig.board.starts == starts;
    if (holding) {
      held.insert(held.end(), data, data + size);
    } else {
      out.swap(held);  // at the first packet of the run
      held.clear();
      out.insert(out.end(), data, data + size);
    }
  });
  std::this_thread::sleep_for(100ms);
  expect_a_run_of_its_own(*source, rig);
  EXPECT_FALSE(holding);
}

}  // namespace
}  // namespace tunnelrig
