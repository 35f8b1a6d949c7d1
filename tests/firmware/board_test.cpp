// Sampler, ring and packetiser together, behind the simulated controller; the host's decoder reads the
// stream.
#include "daq/loss_ledger.h"
#include "daq/packet_decoder.h"
#include "firmware/board_requests.h"

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
using test::set_rate;
using test::statistics;
using test::vendor_out;

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
