// What the board answers to requests, and which it refuses.
#include "firmware/board_requests.h"

#include <array>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using simulated::Board;
using simulated::kStall;
using test::rate;
using test::set_rate;
using test::vendor_out;

TEST(FirmwareCommands, RatesAreThoseTheTimerMakesExactly) {
  Board board;
  board.enumerate();
  EXPECT_EQ(set_rate(board, 4000, 3, 8), 0);
  EXPECT_EQ(rate(board).ticks_per_frame, 63000u);
  EXPECT_EQ(rate(board).oversampling, 8u);
  EXPECT_EQ(set_rate(board, 1333, 1, 1), kStall) << "84 MHz / 1333 is no whole number";
  EXPECT_EQ(set_rate(board, 1000, 1, 1), 0);
  EXPECT_EQ(rate(board).ticks_per_frame, 84000u);
  EXPECT_EQ(set_rate(board, 84000000 / 63004, 1, 8), kStall) << "the scans must be whole, too";
  EXPECT_EQ(set_rate(board, 1000, 1, 4), kStall) << "no filter for that";
  EXPECT_EQ(set_rate(board, 0, 1, 1), kStall);
  EXPECT_EQ(set_rate(board, 1, 0, 1), kStall);
  EXPECT_EQ(set_rate(board, 12000, 1, 1), kStall) << "more than the stream carries";
  EXPECT_EQ(set_rate(board, 4000000000u, 1, 1), kStall);
  EXPECT_EQ(set_rate(board, 10000, 1, 1), 0) << "the fastest";
  for (const std::uint32_t rate_hz : {7000u, 7500u, 8000u, 10000u})
    EXPECT_EQ(set_rate(board, rate_hz, 1, 8), kStall) << "a scan takes 18.4 us";
  EXPECT_EQ(set_rate(board, 84000000, 8 * 1547, 8), kStall);
  EXPECT_EQ(set_rate(board, 84000000, 8 * 1548, 8), 0) << "6782.9 Hz, the fastest with the filter";
  EXPECT_EQ(set_rate(board, 1000, 1, 1), 0);
  vendor_out(board, TRW_USB_START);
  EXPECT_EQ(set_rate(board, 2000, 1, 1), kStall) << "not while running";
  EXPECT_EQ(rate(board).ticks_per_frame, 84000u);
}

TEST(FirmwareCommands, AreAnswered) {
  Board board(0xABCD);
  board.enumerate();
  std::array<std::uint8_t, 128> data{};
  ASSERT_EQ(board.control(0xC0, TRW_USB_IDENTIFY, 0, 0, 128, data.data()), TRW_IDENTITY_SIZE);
  trw_identity identity{};
  ASSERT_TRUE(trw_get_identity(data.data(), TRW_IDENTITY_SIZE, &identity));
  EXPECT_EQ(identity.boot_id, 0xABCDu);
  EXPECT_EQ(identity.variant, TRW_VARIANT_SIMULATED);
  EXPECT_EQ(identity.flags & TRW_FLAG_RUNNING, 0);
  EXPECT_STREQ(identity.describe, "simulated");
  vendor_out(board, TRW_USB_START, TRW_PATTERN_COUNTER);
  board.control(0xC0, TRW_USB_IDENTIFY, 0, 0, 128, data.data());
  trw_get_identity(data.data(), TRW_IDENTITY_SIZE, &identity);
  EXPECT_NE(identity.flags & TRW_FLAG_RUNNING, 0);
  EXPECT_EQ(vendor_out(board, TRW_USB_START, 2), kStall);
  EXPECT_EQ(vendor_out(board, TRW_USB_STOP, 1), kStall);
  EXPECT_EQ(vendor_out(board, TRW_USB_LOADER, 0), kStall) << "not without its key";
  EXPECT_FALSE(board.loader_asked);
  EXPECT_EQ(vendor_out(board, TRW_USB_LOADER, TRW_USB_LOADER_KEY), 0);
  EXPECT_TRUE(board.loader_asked);
  EXPECT_EQ(vendor_out(board, 0x77), kStall);
}

TEST(FirmwareCommands, AmplifiersOnlyWhereTheyAreFitted) {
  Board board;
  board.enumerate();
  std::array<std::uint8_t, 4> data = {200, 0, 9, 0};
  EXPECT_EQ(board.control(0x40, TRW_USB_SET_AMPLIFIER, 1, 0, 4, data.data()), kStall);
  board.amplifier_fitted = true;
  board.power_cycle();
  board.enumerate();
  EXPECT_EQ(board.control(0x40, TRW_USB_SET_AMPLIFIER, 1, 0, 4, data.data()), 4);
  data = {};
  EXPECT_EQ(board.control(0xC0, TRW_USB_GET_AMPLIFIER, 1, 0, 4, data.data()), 4);
  EXPECT_EQ(data[0], 200);
  EXPECT_EQ(board.control(0xC0, TRW_USB_GET_AMPLIFIER, 4, 0, 4, data.data()), kStall);
  data = {0, 1, 0, 0};
  EXPECT_EQ(board.control(0x40, TRW_USB_SET_AMPLIFIER, 1, 0, 4, data.data()), kStall)
      << "gain 256 is refused by the part";
}

}  // namespace
}  // namespace tunnelrig
