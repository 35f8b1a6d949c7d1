// The real libusb logger against the firmware's core, on a bus simulated by umockdev.
#include "daq/usb_source.h"

#include "daq/logging.h"
#include "daq/loss_ledger.h"
#include "daq/packets.h"
#include "daq/usb_board.h"
#include "datasets/error.h"
#include "simulated/usb_bus.h"
#include "support/message_of.h"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

using namespace std::chrono_literals;
using simulated::Pace;

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A board on a bus, plugged in.
struct Rig {
  explicit Rig(Pace pace) : bus(board, pace) { bus.plug(); }
  simulated::Board board;
  simulated::UsbBus bus;
};

struct Logged {
  LogOutcome outcome;
  std::vector<std::int16_t> samples;
  std::vector<Gap> gaps;
};

Logged log_usb(PacketSource& source, double duration_s,
               const std::function<void(const LogProgress&)>& progress = {},
               const std::atomic<bool>& stop = test::never_stop()) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  Logged logged;
  logged.outcome = log_run(source, file, test::cells("R1"), {.duration_s = duration_s}, test::summarizer(),
                           progress, stop);
  test::FrameList list;
  read_raw(file, raw_run(file, "R1").value(), list);
  logged.samples = list.samples;
  logged.gaps = list.gaps;
  EXPECT_TRUE(logged.outcome.ledger.closed());
  EXPECT_EQ(list.count(), logged.outcome.ledger.frames_stored);
  return logged;
}

/// Each stored frame is the one whose place it takes; behind an estimated gap the place is learnt anew.
void expect_every_frame_in_its_place(const Logged& logged) {
  std::map<std::uint64_t, Gap> before;
  std::uint64_t lost = 0;
  for (const Gap& gap : logged.gaps) {
    before[gap.first_frame] = gap;
    lost += gap.frames_lost;
  }
  EXPECT_EQ(lost, logged.outcome.ledger.frames_lost);
  std::uint64_t sequence = logged.outcome.ledger.first_sequence;
  for (std::size_t i = 0; i < logged.samples.size() / 4; ++i, ++sequence) {
    if (const auto gap = before.find(i); gap != before.end()) {
      sequence += gap->second.frames_lost;
      if (gap->second.estimated) {
        for (sequence = 0; simulated::sample_of(sequence, 0) != logged.samples[4 * i];) ++sequence;
      }
    }
    for (std::size_t c = 0; c < 4; ++c) {
      ASSERT_EQ(logged.samples[4 * i + c], simulated::sample_of(sequence, c)) << "stored frame " << i;
    }
  }
}

UsbSourceSettings small_transfers() {
  UsbSourceSettings settings;
  settings.stream.transfer_bytes = 4096;
  return settings;
}

TEST(Usb, StreamsWithoutALoss) {
  Rig rig(Pace::kUnlimited);
  const auto source = open_source("usb");
  const Logged logged = log_usb(*source, 600);
  EXPECT_EQ(logged.outcome.state, RunState::kComplete);
  EXPECT_EQ(logged.outcome.ledger.frames_stored, 800000u);
  EXPECT_EQ(logged.outcome.ledger.frames_lost + logged.outcome.ledger.frames_duplicate, 0u);
  EXPECT_EQ(logged.outcome.ledger.bytes_skipped, 0u);
  expect_every_frame_in_its_place(logged);
}

TEST(Usb, RecordsTheRigInRealTimeAndRunsFollowEachOther) {
  Rig rig(Pace::kRig);
  const auto source = open_source("usb:5A5B");
  for (int run = 0; run < 2; ++run) {
    const auto started = std::chrono::steady_clock::now();
    const Logged logged = log_usb(*source, 0.6);
    EXPECT_GT(since(started), 0.5) << "frames from before the run would end it early";
    EXPECT_EQ(logged.outcome.ledger.frames_lost, 0u);
    EXPECT_EQ(logged.outcome.ledger.silences, 0u);
    expect_every_frame_in_its_place(logged);
    std::this_thread::sleep_for(200ms);  // the operator moves the rig
  }
}

TEST(Usb, SeesTheBoardsOnTheBus) {
  EXPECT_TRUE(list_usb_boards().empty());
  Rig rig(Pace::kRig);
  const auto found = list_usb_boards();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].serial, "5A5B5C5D5E5F606162636465");
  EXPECT_EQ(found[0].problem, "");
  ASSERT_TRUE(found[0].identity && found[0].rate && found[0].statistics);
  EXPECT_EQ(found[0].identity->variant, TRW_VARIANT_SIMULATED);
  EXPECT_EQ(found[0].rate->ticks_per_frame, 63000u);
}

TEST(Usb, SaysWhyABoardCannotBeHad) {
  using test::message_of;
  EXPECT_NE(message_of([] { open_source("usb"); }).find("no board is plugged in"), std::string::npos);
  Rig rig(Pace::kRig);
  EXPECT_NE(message_of([] { open_source("usb:77"); }).find("there are 5A5B5C5D5E5F606162636465"),
            std::string::npos);
  EXPECT_NE(message_of([] { open_source("usb:,bogus"); }).find("test-pattern"), std::string::npos);
  EXPECT_NE(message_of([] { open_source("usb:,rate=1333"); }).find("refuses"), std::string::npos);
  EXPECT_NE(message_of([] { open_source("usb:,rate=1/0"); }).find("rate=4000/3"), std::string::npos);
}

/// Takes the right to open a board's node away; root loses it by becoming nobody for a while.
struct NoPermission {
  explicit NoPermission(const UsbDevice& device) {
    namespace fs = std::filesystem;
    const fs::path bed = std::getenv("UMOCKDEV_DIR");
    fs::permissions(bed, fs::perms::all);  // sockets stand in for the kernel; they are not what is refused
    for (const auto& entry : fs::recursive_directory_iterator(bed))
      if (entry.is_socket() || entry.is_directory()) fs::permissions(entry.path(), fs::perms::all);
    fs::permissions(bed / fmt::format("dev/bus/usb/{:03}/{:03}", device.bus, device.address),
                    fs::perms::none);
    if (was_ == 0 && ::seteuid(65534) != 0) throw std::runtime_error("root cannot become nobody");
  }
  ~NoPermission() {
    if (was_ == 0 && ::seteuid(was_) != 0) std::abort();
  }
  NoPermission(const NoPermission&) = delete;
  NoPermission& operator=(const NoPermission&) = delete;

 private:
  uid_t was_ = ::geteuid();
};

TEST(Usb, NamesTheRuleWherePermissionIsMissing) {
  Rig rig(Pace::kRig);
  const auto board = list_usb_boards();
  ASSERT_EQ(board.size(), 1u);
  const NoPermission held(board[0]);
  const auto found = list_usb_boards();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].no_permission);
  EXPECT_NE(found[0].problem.find("60-tunnelrig.rules"), std::string::npos) << found[0].problem;
  EXPECT_NE(test::message_of([] { open_source("usb"); }).find("60-tunnelrig.rules"), std::string::npos);
}

TEST(Usb, SetsRateOversamplingAndPattern) {
  Rig rig(Pace::kRig);
  const auto source = open_source("usb:,rate=1000,oversampling=8,test-pattern");
  rig.bus.with_board([](simulated::Board& board) {
    EXPECT_EQ(board.core.rate.ticks_per_frame, 84000u);
    EXPECT_EQ(board.scans_per_frame, 8u);
    EXPECT_EQ(board.ticks_per_scan, 10500u);
    EXPECT_TRUE(board.core.pattern);
  });
}

TEST(Usb, AStallIsClearedAndCostsNothing) {
  Rig rig(Pace::kUnlimited);
  const auto source = open_usb_source("usb", small_transfers());
  std::atomic<bool> done{false};
  std::thread troublemaker([&] {
    for (int i = 0; i < 20 && !done; ++i) {
      std::this_thread::sleep_for(10ms);
      rig.bus.with_board([](simulated::Board& board) { board.control(0x02, 3, 0, 0x81, 0, nullptr); });
    }
  });
  const Logged logged = log_usb(*source, 1200);
  done = true;
  troublemaker.join();
  rig.bus.with_board([](simulated::Board& board) { EXPECT_GT(board.core.usb.stalls, 3u); });
  EXPECT_EQ(logged.outcome.state, RunState::kComplete);
  EXPECT_EQ(logged.outcome.ledger.frames_lost, 0u);
  expect_every_frame_in_its_place(logged);
}

TEST(Usb, AnErroredTransferIsAGapWithItsCause) {
  for (const auto& [error, cause] : {std::pair{EPROTO, "usb-error"}, std::pair{EOVERFLOW, "usb-overflow"}}) {
    Rig rig(Pace::kRig);
    rig.bus.set_mangle([](const std::uint8_t* data, std::size_t size, std::vector<std::uint8_t>& out) {
      out.assign(data, data + size);
    });
    const auto source = open_usb_source("usb", {});
    std::thread troublemaker([&, error = error] {
      std::this_thread::sleep_for(300ms);
      // A transfer takes bytes of the board and loses them.
      rig.bus.set_mangle([](const std::uint8_t*, std::size_t, std::vector<std::uint8_t>&) {});
      std::this_thread::sleep_for(60ms);
      rig.bus.fail_transfer(error, false);
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
  std::thread operator_thread([&] {
    std::this_thread::sleep_for(500ms);
    rig.bus.unplug();
    std::this_thread::sleep_for(600ms);
    rig.bus.with_board([](simulated::Board& board) { board.power_cycle(); });  // fed by the bus
    rig.bus.plug();
  });
  const Logged logged = log_usb(*source, 3);
  operator_thread.join();
  EXPECT_EQ(logged.outcome.state, RunState::kComplete);
  EXPECT_EQ(logged.outcome.ledger.reboots, 1u);
  ASSERT_EQ(logged.gaps.size(), 1u);
  EXPECT_EQ(logged.gaps[0].cause, "unplugged");
  EXPECT_TRUE(logged.gaps[0].estimated);
  EXPECT_GT(logged.gaps[0].frames_lost, 0.55 * 4000 / 3);
  EXPECT_LT(logged.gaps[0].frames_lost, 2.6 * 4000 / 3) << "data again within 2 s of the new enumeration";
  expect_every_frame_in_its_place(logged);
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
  for (int cycle = 0; cycle < 3; ++cycle) {
    for (int i = 0; i < 10; ++i) read();
    auto started = std::chrono::steady_clock::now();
    rig.bus.unplug();
    while (read() != ReadResult::Status::kBroken) ASSERT_LT(since(started), 1);
    EXPECT_LT(since(started), 0.25);
    EXPECT_FALSE(source->reopen());
    rig.bus.plug();
    started = std::chrono::steady_clock::now();
    while (!source->reopen()) {
      ASSERT_LT(since(started), 2);
      std::this_thread::sleep_for(20ms);
    }
    while (read() != ReadResult::Status::kData) ASSERT_LT(since(started), 2);
  }
  EXPECT_EQ(tracker.ledger().frames_lost, 0u) << "the ring holds three seconds";
  EXPECT_GT(tracker.ledger().frames_stored, 300u);
}

TEST(Usb, AHundredCyclesOfPluggingLeaveNothingBehind) {
  Rig rig(Pace::kUnlimited);
  for (int cycle = 0; cycle < 100; ++cycle) {
    const auto source = open_usb_source("usb", small_transfers());
    std::vector<std::byte> buffer(8192);
    for (int i = 0; i < 3; ++i)
      ASSERT_EQ(source->read(buffer, 500ms).status, ReadResult::Status::kData) << cycle;
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
  ASSERT_EQ(source->read(buffer, 500ms).status, ReadResult::Status::kData);
  rig.bus.with_board(
      [](simulated::Board& board) { board_stop(&board.core); });  // as a watchdog without a new enumeration
  const auto started = std::chrono::steady_clock::now();
  ReadResult result;
  do result = source->read(buffer, 50ms);
  while (result.status != ReadResult::Status::kBroken && since(started) < 2);
  EXPECT_STREQ(result.cause, "silent");
  EXPECT_LT(since(started), 0.6);
  EXPECT_TRUE(source->reopen());
  EXPECT_EQ(source->read(buffer, 500ms).status, ReadResult::Status::kData);
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
    log_usb(*source, 60, {}, stop);
    source.reset();
    const double took_s = since(asked);
    user.join();
    EXPECT_LT(took_s, 1) << "deaf for " << when_ms << " ms";
  }
}

}  // namespace
}  // namespace tunnelrig
