// What a board on the bus is asked, set to and streams.
#include "daq/usb_board.h"
#include "datasets/error.h"
#include "rig.h"
#include "support/message_of.h"
#include "support/wall_clock.h"

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

using namespace std::chrono_literals;
using simulated::Pace;

using test::expect_every_frame_in_its_place;
using test::log_usb;
using test::Logged;
using test::Rig;
using test::since;

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
    if (test::kClockCounts) {
      EXPECT_EQ(logged.outcome.ledger.silences, 0u);
    }
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

TEST(Usb, RefusesABoardWithoutAClock) {
  Rig rig(Pace::kRig);
  rig.board.core.identity.tick_hz = 0;
  EXPECT_NE(test::message_of([] { open_source("usb"); }).find("its clock runs at 0 Hz"), std::string::npos);
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

}  // namespace
}  // namespace tunnelrig
