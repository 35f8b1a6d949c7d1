// What a stall, an error, a pulled cable and a hung bus do to what is recorded.
#include "daq/loss_ledger.h"
#include "rig.h"
#include "support/wall_clock.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using namespace std::chrono_literals;
using simulated::Pace;
using test::expect_every_frame_in_its_place;
using test::log_usb;
using test::Logged;
using test::patience_s;
using test::Rig;
using test::since;

constexpr double kRate_hz = 4000.0 / 3;

/// Waits for `done`; false where it does not come within `promised_s`.
bool wait_for(double promised_s, const std::function<bool()>& done) {
  const auto started = std::chrono::steady_clock::now();
  while (!done()) {
    if (since(started) > patience_s(promised_s)) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

/// Reads until bytes come or the stream breaks.
ReadResult read_something(PacketSource& source, std::vector<std::byte>& buffer, double promised_s = 0.5) {
  const auto started = std::chrono::steady_clock::now();
  ReadResult result;
  do result = source.read(buffer, 50ms);
  while (result.status == ReadResult::Status::kNothing && since(started) < patience_s(promised_s));
  return result;
}

TEST(Usb, AStallIsClearedAndCostsNothing) {
  Rig rig(Pace::kUnlimited);
  UsbSourceSettings settings = test::small_transfers();
  if (!test::kClockCounts) settings.stream.drain_wait = 30s;
  const auto source = open_usb_source("usb", settings);
  std::atomic<bool> stop{false}, streaming{false};
  const auto stalls = [&] {
    std::uint32_t count = 0;
    rig.bus.with_board([&](simulated::Board& board) { count = board.core.usb.stalls; });
    return count;
  };
  std::thread troublemaker([&] {
    EXPECT_TRUE(wait_for(10, [&] { return streaming.load(); }));
    for (int i = 0; i < 10; ++i) {
      const auto before = stalls();
      rig.bus.with_board([](simulated::Board& board) { board.control(0x02, 3, 0, 0x81, 0, nullptr); });
      EXPECT_TRUE(wait_for(2, [&] { return stalls() > before; }));
      std::this_thread::sleep_for(10ms);
    }
    stop = true;
  });
  const auto progress = [&](const LogProgress& now) { streaming = now.ledger->frames_stored > 0; };
  const Logged logged = log_usb(*source, 1e6, progress, stop);
  troublemaker.join();
  EXPECT_EQ(logged.outcome.ledger.end_reason, "stopped by the user");
  EXPECT_GT(logged.outcome.ledger.frames_stored, 0u);
  EXPECT_EQ(logged.outcome.ledger.frames_lost, 0u);
  expect_every_frame_in_its_place(logged);
}

TEST(Usb, AnErroredTransferIsAGapWithItsCause) {
  for (const auto& [error, cause] : {std::pair{EPROTO, "usb-error"}, std::pair{EOVERFLOW, "usb-overflow"}}) {
    Rig rig(Pace::kRig);
    // A transfer takes bytes of the board and loses them, when the run has got some (its start is the board's
    // second).
    std::atomic<int> packets{0};
    rig.bus.set_mangle([&](const std::uint8_t* data, std::size_t size, std::vector<std::uint8_t>& out) {
      if (rig.board.starts > 1) ++packets;
      if (packets <= 100) out.assign(data, data + size);
    });
    const auto source = open_usb_source("usb", {});
    std::thread troublemaker([&, error = error] {
      EXPECT_TRUE(wait_for(2, [&] { return packets > 120; }));
      EXPECT_TRUE(wait_for(2, [&] { return rig.bus.fail_transfer(error, false); }));
      rig.bus.set_mangle({});
    });
    const Logged logged = log_usb(*source, 1);
    troublemaker.join();
    ASSERT_FALSE(logged.gaps.empty());
    EXPECT_EQ(logged.gaps.front().cause, cause);
    expect_every_frame_in_its_place(logged);
  }
}

TEST(Usb, APulledCableIsAGapAndTheRunGoesOn) {
  Rig rig(Pace::kRig);
  const auto source = open_source("usb");
  std::atomic<bool> streaming{false};
  std::thread operator_thread([&] {
    EXPECT_TRUE(wait_for(2, [&] { return streaming.load(); }));
    std::this_thread::sleep_for(300ms);
    rig.bus.unplug();
    std::this_thread::sleep_for(600ms);
    rig.bus.with_board([](simulated::Board& board) { board.power_cycle(); });  // fed by the bus
    rig.bus.plug();
  });
  const auto progress = [&](const LogProgress& now) { streaming = now.ledger->frames_stored > 0; };
  const Logged logged = log_usb(*source, 3, progress);
  operator_thread.join();
  EXPECT_EQ(logged.outcome.state, RunState::kComplete);
  EXPECT_EQ(logged.outcome.ledger.reboots, 1u);
  ASSERT_EQ(logged.gaps.size(), 1u);
  EXPECT_TRUE(logged.gaps[0].estimated);
  EXPECT_GT(logged.gaps[0].frames_lost, 0u);
  if (test::kClockCounts) {
    EXPECT_EQ(logged.gaps[0].cause, "unplugged");  // and not first of all silent
    EXPECT_GT(static_cast<double>(logged.gaps[0].frames_lost), 0.55 * kRate_hz);
    EXPECT_LT(static_cast<double>(logged.gaps[0].frames_lost), 2.6 * kRate_hz)
        << "data again within 2 s of the new enumeration";
  }
  expect_every_frame_in_its_place(logged);
}

TEST(Usb, ABoardThatWasWithoutPowerIsSetAsItWas) {
  Rig rig(Pace::kRig);
  open_source("usb:,rate=1000,oversampling=8").reset();
  const auto source = open_source("usb");  // by a later program, as the board is set
  std::atomic<bool> streaming{false};
  std::thread operator_thread([&] {
    EXPECT_TRUE(wait_for(10, [&] { return streaming.load(); }));
    rig.bus.unplug();
    rig.bus.with_board([](simulated::Board& board) { board.power_cycle(); });
    rig.bus.plug();
  });
  const auto progress = [&](const LogProgress& now) { streaming = now.ledger->frames_stored > 0; };
  const Logged logged = log_usb(*source, 2, progress);
  operator_thread.join();
  EXPECT_EQ(logged.outcome.state, RunState::kComplete) << logged.outcome.ledger.end_reason;
  EXPECT_EQ(logged.outcome.ledger.reboots, 1u);
  EXPECT_EQ(logged.outcome.ledger.conversions_per_frame, 8u);
  rig.bus.with_board([](simulated::Board& board) {
    EXPECT_EQ(board.core.rate.oversampling, 8u);
    EXPECT_EQ(board.core.rate.ticks_per_frame, 84000u);
  });
}

TEST(Usb, AnotherBoardInItsPlaceIsNotTheRuns) {
  Rig rig(Pace::kRig);
  const auto source = open_source("usb");  // whichever there is
  std::atomic<bool> streaming{false}, refused{false};
  const auto plug_in = [&](std::uint8_t serial) {
    rig.bus.unplug();
    rig.bus.with_board([&](simulated::Board& board) { board.replace(serial); });
    rig.bus.plug();
  };
  std::thread operator_thread([&] {
    EXPECT_TRUE(wait_for(10, [&] { return streaming.load(); }));
    plug_in(0x77);
    EXPECT_TRUE(wait_for(10, [&] { return refused.load(); }));
    rig.bus.with_board([](simulated::Board& board) { EXPECT_FALSE(board.running()); });
    plug_in(0x5A);
  });
  const auto progress = [&](const LogProgress& now) {
    streaming = now.ledger->frames_stored > 0;
    if (now.problem.find("no board of serial number 5A5B5C5D5E5F606162636465; there are 7778797A") == 0)
      refused = true;
  };
  const Logged logged = log_usb(*source, 3, progress);
  operator_thread.join();
  EXPECT_EQ(logged.outcome.state, RunState::kComplete);
  EXPECT_EQ(logged.outcome.ledger.board_serial, "5A5B5C5D5E5F606162636465");
  EXPECT_EQ(logged.outcome.ledger.reboots, 1u);
  EXPECT_EQ(source->problem(), "");
}

TEST(Usb, AnUnplugIsNoticedAndABoardWithItsOwnSupplyLosesNothing) {
  Rig rig(Pace::kRig);
  const auto source = open_source("usb");
  std::vector<std::byte> buffer(65536);
  PacketDecoder decoder;
  LossTracker tracker(0);
  test::FrameList frames;
  struct Sink : PacketSink {
    LossTracker* tracker = nullptr;
    FrameSink* frames = nullptr;
    void packet(const Packet& packet) override { tracker->take(packet, 0, *frames); }
  } sink;
  sink.tracker = &tracker;
  sink.frames = &frames;
  const auto read = [&] {
    const ReadResult result = source->read(buffer, 50ms);
    decoder.push(std::span(buffer).first(result.size), sink);
    return result.status;
  };
  double longest_away_s = 0;
  for (int cycle = 0; cycle < 3; ++cycle) {
    const auto stored = tracker.ledger().frames_stored;
    EXPECT_TRUE(wait_for(5, [&] {
      return read() == ReadResult::Status::kData && tracker.ledger().frames_stored > stored + 100;
    }));
    const auto unplugged = std::chrono::steady_clock::now();
    rig.bus.unplug();
    ASSERT_TRUE(wait_for(1, [&] { return read() == ReadResult::Status::kBroken; }));
    if (test::kClockCounts) {
      EXPECT_LT(since(unplugged), 0.25);
    }
    EXPECT_FALSE(source->reopen());
    rig.bus.plug();
    ASSERT_TRUE(wait_for(2, [&] { return source->reopen(); }));
    ASSERT_TRUE(wait_for(2, [&] { return read() == ReadResult::Status::kData; }));
    longest_away_s = std::max(longest_away_s, since(unplugged));
  }
  EXPECT_GT(tracker.ledger().frames_stored, 300u);
  if (longest_away_s < 2.5) {
    EXPECT_EQ(tracker.ledger().frames_lost, 0u) << "the ring holds three seconds";
  }
}

TEST(Usb, AHundredCyclesOfPluggingLeaveNothingBehind) {
  Rig rig(Pace::kUnlimited);
  for (int cycle = 0; cycle < 100; ++cycle) {
    const auto source = open_usb_source("usb", test::small_transfers());
    std::vector<std::byte> buffer(8192);
    for (int i = 0; i < 3; ++i)
      ASSERT_EQ(read_something(*source, buffer).status, ReadResult::Status::kData) << cycle;
    rig.bus.unplug();
    while (source->read(buffer, 50ms).status != ReadResult::Status::kBroken) {
    }
    rig.bus.plug();
  }
}

TEST(Usb, ASilentBoardIsReopened) {
  Rig rig(Pace::kRig);
  const auto source = open_source("usb");
  std::vector<std::byte> buffer(8192);
  ASSERT_EQ(read_something(*source, buffer).status, ReadResult::Status::kData);
  rig.bus.with_board(
      [](simulated::Board& board) { board_stop(&board.core); });  // as a watchdog without a new enumeration
  const auto started = std::chrono::steady_clock::now();
  ReadResult result;
  ASSERT_TRUE(wait_for(2, [&] {
    result = source->read(buffer, 50ms);
    return result.status == ReadResult::Status::kBroken;
  }));
  EXPECT_STREQ(result.cause, "silent");
  if (test::kClockCounts) {
    EXPECT_LT(since(started), 0.6);
  }
  EXPECT_TRUE(source->reopen());
  EXPECT_EQ(read_something(*source, buffer).status, ReadResult::Status::kData);
}

TEST(Usb, StopComesBackWithinASecondWhateverTheBusDoes) {
  for (const int when_ms : {0, 100, 300, 400, 500, 700}) {
    Rig rig(Pace::kRig);
    std::unique_ptr<PacketSource> source = open_source("usb");
    std::atomic<bool> stop{false};
    std::chrono::steady_clock::time_point asked;
    std::thread user([&] {
      std::this_thread::sleep_for(300ms);
      rig.bus.set_deaf(true);
      std::this_thread::sleep_for(std::chrono::milliseconds(when_ms));
      asked = std::chrono::steady_clock::now();
      stop = true;
    });
    log_usb(*source, 600, {}, stop);
    source.reset();
    const double took_s = since(asked);
    user.join();
    EXPECT_LT(took_s, patience_s(1)) << "deaf for " << when_ms << " ms";
  }
}

}  // namespace
}  // namespace tunnelrig
