// Sampler, ring, packetiser and commands together, behind the simulated controller; the host's decoder reads
// the stream.
#include "simulated/board.h"

#include "daq/loss_ledger.h"
#include "daq/packet_decoder.h"

#include <array>
#include <cstring>
#include <random>
#include <span>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using simulated::Board;
using simulated::kNak;
using simulated::kStall;

/// The host's end: every stored frame must be the one that its number says.
class Host : public PacketSink, public FrameSink {
 public:
  explicit Host(Board& board) : board_(board) {}

  /// Takes all packets that the board has; the bytes.
  std::size_t drain() {
    std::size_t bytes = 0;
    std::array<std::uint8_t, 64> packet;
    for (int idle = 0; idle < 2;) {
      board_.poll();
      const int size = board_.controller.in_packet(packet.data(), packet.size());
      idle = size < 0 ? idle + 1 : 0;
      if (size <= 0) continue;
      bytes += static_cast<std::size_t>(size);
      decoder.push(std::as_bytes(std::span(packet.data(), static_cast<std::size_t>(size))), *this);
    }
    return bytes;
  }

  void packet(const Packet& packet) override {
    last = packet.header;
    longest = std::max(longest, packet.header.frame_count);
    next_ = packet.header.first_sequence;
    in_packet_ = &packet;
    tracker.take(packet, 0, *this);
  }
  void frames(std::span<const std::byte> data) override {
    const std::size_t count = data.size() / 8;
    const std::uint64_t first = next_ + in_packet_->header.frame_count - count;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t c = 0; c < 4; ++c) {
        std::int16_t sample = 0;
        std::memcpy(&sample, data.data() + 8 * i + 2 * c, 2);
        const std::int16_t expected = pattern ? board_pattern(first + i, static_cast<std::uint32_t>(c))
                                              : simulated::sample_of(first + i, c);
        if (sample != expected) ++wrong;
      }
    }
  }
  void gap(const Gap& gap) override { gaps.push_back(gap); }

  PacketDecoder decoder;
  LossTracker tracker{0};
  std::vector<Gap> gaps;
  trw_header last{};
  std::uint8_t longest = 0;
  std::uint64_t wrong = 0;
  bool pattern = false;

 private:
  Board& board_;
  std::uint64_t next_ = 0;
  const Packet* in_packet_ = nullptr;
};

int vendor_out(Board& board, std::uint8_t request, std::uint16_t value = 0) {
  return board.control(0x40, request, value, 0, 0, nullptr);
}

trw_statistics statistics(Board& board) {
  std::array<std::uint8_t, TRW_STATISTICS_SIZE> data{};
  EXPECT_EQ(board.control(0xC0, TRW_USB_STATISTICS, 0, 0, TRW_STATISTICS_SIZE, data.data()),
            TRW_STATISTICS_SIZE);
  trw_statistics found{};
  trw_get_statistics(data.data(), &found);
  return found;
}

int set_rate(Board& board, std::uint32_t numerator, std::uint32_t denominator, std::uint32_t oversampling) {
  std::array<std::uint8_t, TRW_RATE_WISH_SIZE> data{};
  const trw_rate_wish wish{numerator, denominator, oversampling};
  trw_put_rate_wish(data.data(), &wish);
  const int result = board.control(0x40, TRW_USB_SET_RATE, 0, 0, TRW_RATE_WISH_SIZE, data.data());
  return result == TRW_RATE_WISH_SIZE ? 0 : result;
}

trw_rate rate(Board& board) {
  std::array<std::uint8_t, TRW_RATE_SIZE> data{};
  EXPECT_EQ(board.control(0xC0, TRW_USB_GET_RATE, 0, 0, TRW_RATE_SIZE, data.data()), TRW_RATE_SIZE);
  trw_rate found{};
  trw_get_rate(data.data(), &found);
  return found;
}

TEST(FirmwareBoard, StreamsEveryFrameInOrder) {
  Board board(7);
  Host host(board);
  board.enumerate();
  ASSERT_EQ(vendor_out(board, TRW_USB_START), 0);
  for (int step = 0; step < 5000; ++step) {
    board.advance(1 + static_cast<std::uint64_t>(step % 40));
    host.drain();
  }
  const Ledger& ledger = host.tracker.ledger();
  EXPECT_EQ(ledger.frames_lost + ledger.frames_duplicate + ledger.frames_late, 0u);
  EXPECT_LT(board.frames_sampled() - ledger.frames_stored, std::uint64_t{BOARD_PACKET_FRAMES});
  EXPECT_EQ(host.decoder.bytes_skipped(), 0u);
  EXPECT_EQ(host.wrong, 0u);
  EXPECT_EQ(host.last.boot_id, 7u);
  EXPECT_EQ(host.last.tick_hz, 84000000u);
  EXPECT_EQ(host.last.ticks_per_frame, 63000u);
  EXPECT_EQ(host.last.first_ticks, (host.last.first_sequence + 1) * 63000);
}

TEST(FirmwareBoard, HoldsTwoSecondsOfSilenceAndShowsWhatItLosesBeyond) {
  Board board;
  Host host(board);
  board.enumerate();
  vendor_out(board, TRW_USB_START);
  board.advance(160);
  host.drain();
  board.advance(2 * 1334);
  host.drain();
  EXPECT_TRUE(host.gaps.empty()) << "2 s";
  EXPECT_EQ(host.longest, TRW_MAX_FRAMES) << "a backlog goes out in long packets";
  board.advance(6000);
  host.drain();
  board.advance(100);
  host.drain();
  ASSERT_EQ(host.gaps.size(), 1u);
  EXPECT_EQ(host.gaps[0].cause, "overrun");
  const trw_statistics now = statistics(board);
  EXPECT_EQ(now.overruns, host.gaps[0].frames_lost);
  EXPECT_EQ(now.ring_peak, std::uint32_t{BOARD_RING_FRAMES});
  EXPECT_EQ(host.tracker.ledger().frames_lost, now.overruns);
  EXPECT_EQ(host.wrong, 0u);
}

TEST(FirmwareBoard, AStallOrAPulledCableCostsNothingThatTheRingHolds) {
  Board board;
  Host host(board);
  board.enumerate();
  vendor_out(board, TRW_USB_START);
  std::mt19937 random(1);
  std::array<std::uint8_t, 64> packet{};
  for (int round = 0; round < 3000; ++round) {
    board.advance(random() % 40);
    board.poll();
    for (auto part = random() % 60; part > 0; --part) {  // in the middle of a transfer …
      const int size = board.controller.in_packet(packet.data(), packet.size());
      if (size > 0)
        host.decoder.push(std::as_bytes(std::span(packet.data(), static_cast<std::size_t>(size))), host);
    }
    if (round % 3 == 0) {  // … the cable of a board with its own supply
      board.controller.reset();
      board.enumerate();
    } else if (round % 3 == 1) {
      board.control(0x02, 3, 0, 0x81, 0, nullptr);
      EXPECT_EQ(board.controller.in_packet(packet.data(), packet.size()), kStall);
      board.control(0x02, 1, 0, 0x81, 0, nullptr);
    }
  }
  board.advance(64);
  host.drain();
  const Ledger& ledger = host.tracker.ledger();
  EXPECT_EQ(ledger.frames_lost, 0u);
  EXPECT_GT(ledger.frames_duplicate, 0u) << "what was sent twice is known by its number";
  EXPECT_GT(ledger.frames_stored, 50000u);
  EXPECT_EQ(host.wrong, 0u);
}

TEST(FirmwareBoard, StopDropsWhatWasNotSentAndNumbersGoOn) {
  Board board;
  Host host(board);
  board.enumerate();
  vendor_out(board, TRW_USB_START);
  board.advance(1000);
  vendor_out(board, TRW_USB_STOP);
  EXPECT_EQ(host.drain(), 0u);
  board.advance(500);
  vendor_out(board, TRW_USB_START);
  vendor_out(board, TRW_USB_START);  // running already: goes on
  EXPECT_EQ(board.starts, 2u);
  board.advance(160);
  host.drain();
  EXPECT_EQ(host.tracker.ledger().first_sequence, 1000u);
  EXPECT_EQ(host.last.first_ticks, (1501 + host.last.first_sequence - 1000) * 63000);
  EXPECT_EQ(host.wrong, 0u);
}

TEST(FirmwareBoard, WhatAStopHasOvertakenIsNotSentAgain) {
  Board board;
  Host host(board);
  board.enumerate();
  vendor_out(board, TRW_USB_START);
  board.advance(1000);
  board.poll();  // frames 0 … are on their way
  std::array<std::uint8_t, 64> packet{};
  EXPECT_EQ(board.controller.in_packet(packet.data(), packet.size()), 64);
  board.control(0x02, 3, 0, 0x81, 0, nullptr);
  vendor_out(board, TRW_USB_STOP);
  vendor_out(board, TRW_USB_START);
  board.control(0x02, 1, 0, 0x81, 0, nullptr);
  board.advance(160);
  host.drain();
  EXPECT_EQ(host.tracker.ledger().first_sequence, 1000u);
  EXPECT_EQ(host.tracker.ledger().frames_lost, 0u);
}

TEST(FirmwareBoard, ConverterErrorsAreTimeThatIsMissing) {
  Board board;
  Host host(board);
  board.enumerate();
  vendor_out(board, TRW_USB_START);
  board.advance(160);
  board_on_adc_error(&board.core, 5);
  board.advance(160);
  host.drain();
  ASSERT_EQ(host.gaps.size(), 1u);
  EXPECT_EQ(host.gaps[0].frames_lost, 5u);
  EXPECT_EQ(host.gaps[0].cause, "adc-error");
  EXPECT_EQ(host.tracker.ledger().frames_adc_error, 1u);
  EXPECT_EQ(statistics(board).adc_errors, 1u);
}

/// Frames of eight equal conversions each, straight from the ring.
class FilteredBoard : public testing::Test {
 protected:
  FilteredBoard() {
    const trw_rate_wish wish{4000, 3, DECIMATION};
    EXPECT_TRUE(board_set_rate(&board.core, &wish));
    board_start(&board.core, false);
  }
  trw_frame next(const std::array<std::uint16_t, TRW_CHANNELS>& counts) {
    std::array<std::uint16_t, std::size_t{DECIMATION} * TRW_CHANNELS> scans;
    for (std::size_t i = 0; i < scans.size(); ++i) scans[i] = counts[i % TRW_CHANNELS];
    const std::uint32_t slot = board.core.ring.head % BOARD_RING_FRAMES;
    board_on_scans(&board.core, scans.data());
    return board.core.slots[slot].frame;
  }

  Board board;
};

TEST_F(FilteredBoard, BehindAConverterErrorNothingIsLeftOfBefore) {
  for (int i = 0; i < 30; ++i) (void)next({1000, 1000, 1000, 0});
  board_on_adc_error(&board.core, 5);
  for (int i = 0; i < 30; ++i) {
    const trw_frame frame = next({3000, 2000, 1000, 500});
    EXPECT_EQ(frame.sample[0], 3000) << i;
    EXPECT_EQ(frame.sample[1], 2000) << i;
    EXPECT_EQ(frame.status, i == 0 ? TRW_STATUS_ADC_ERROR : 0)
        << "and nothing of what was clipped, frame " << i;
  }
}

TEST_F(FilteredBoard, EveryFrameThatHoldsAClippedBlockSaysSo) {
  for (int i = 0; i < 20; ++i) EXPECT_EQ(next({2000, 2000, 2000, 2000}).status, 0);
  for (int i = 0; i < 20; ++i) {
    const trw_frame frame = next({2000, 2000, static_cast<std::uint16_t>(i == 0 ? 4095 : 2000), 2000});
    EXPECT_EQ(frame.status, i < DECIMATOR_BLOCKS ? 1u << 2 : 0u) << i;
    EXPECT_TRUE(frame.sample[2] == 2000 || frame.status != 0) << i;
  }
  (void)next({0, 2000, 2000, 2000});
  for (int i = 0; i < 5; ++i) EXPECT_EQ(next({2000, 2000, 2000, 2000}).status, 1);
  board_stop(&board.core);
  board_start(&board.core, false);
  EXPECT_EQ(next({2000, 2000, 2000, 2000}).status, 0) << "another run";
}

TEST(FirmwareBoard, AConverterErrorInTheFirstFrameMissesNothing) {
  Board board;
  board.enumerate();
  vendor_out(board, TRW_USB_START);
  const std::uint64_t origin = board.core.origin_ticks, frame = board.core.rate.ticks_per_frame;
  EXPECT_EQ(board_frames_missed(&board.core, origin - frame / 2), 0u) << "the first frame is not yet due";
  EXPECT_EQ(board_frames_missed(&board.core, origin), 1u);
  EXPECT_EQ(board_frames_missed(&board.core, origin + 4 * frame + 1), 5u);
  board.advance(5);
  EXPECT_EQ(board_frames_missed(&board.core, origin + 4 * frame + 1), 0u);
}

TEST(FirmwareBoard, AnEmptyPacketEndsATransferOfWholePackets) {
  Board board;
  board.enumerate();
  ASSERT_EQ(set_rate(board, 200, 1, 1), 0);  // two frames per packet, 64 bytes
  vendor_out(board, TRW_USB_START);
  board.advance(6);
  std::array<std::uint8_t, 64> packet{};
  std::vector<int> sizes;
  for (int i = 0; i < 10; ++i) {
    board.poll();
    const int size = board.controller.in_packet(packet.data(), packet.size());
    if (size != kNak) sizes.push_back(size);
  }
  EXPECT_EQ(sizes, (std::vector<int>{64, 64, 64, 0}));
}

TEST(FirmwareBoard, RatesAreThoseTheTimerMakesExactly) {
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

TEST(FirmwareBoard, CommandsAnswer) {
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

TEST(FirmwareBoard, AmplifiersOnlyWhereTheyAreFitted) {
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

TEST(FirmwareBoard, TestPatternCountsInEveryChannel) {
  Board board;
  Host host(board);
  host.pattern = true;
  board.enumerate();
  vendor_out(board, TRW_USB_START, TRW_PATTERN_COUNTER);
  for (int i = 0; i < 200; ++i) {
    board.advance(1000);
    host.drain();
  }
  EXPECT_EQ(host.wrong, 0u);
  EXPECT_GT(host.tracker.ledger().frames_stored, 199000u);
}

TEST(FirmwareBoard, NumbersGoOnBeyondThirtyTwoBits) {
  Board board;
  Host host(board);
  board.enumerate();
  board.core.sequence = 0xFFFFFF00u;  // 37 days of the rig
  board.core.sent_sequence = 0xFFFFFF00u;
  vendor_out(board, TRW_USB_START);
  board.advance(1024);
  host.drain();
  EXPECT_EQ(host.last.first_sequence + host.last.frame_count, 0x1'0000'0300u);
  EXPECT_EQ(host.tracker.ledger().frames_lost, 0u);
  EXPECT_EQ(host.wrong, 0u);
}

}  // namespace
}  // namespace tunnelrig
