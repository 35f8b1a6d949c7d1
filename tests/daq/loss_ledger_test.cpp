#include "daq/loss_ledger.h"

#include "daq/packets.h"

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::FrameList;
using test::PacketSpec;

/// Feeds packets through the decoder into a tracker at given times.
struct Tracking {
  explicit Tracking(std::uint64_t wanted = 0) : tracker(wanted) {}

  void take(const PacketSpec& spec, double time_s = 0) {
    struct Into : PacketSink {
      Into(LossTracker& t, FrameSink& s, double at) : tracker(t), sink(s), time_s(at) {}
      void packet(const Packet& packet) override { tracker.take(packet, time_s, sink); }
      LossTracker& tracker;
      FrameSink& sink;
      double time_s;
    } into(tracker, list, time_s);
    PacketDecoder decoder;
    decoder.push(test::packet_bytes(spec), into);
    EXPECT_TRUE(tracker.ledger().closed());
    EXPECT_EQ(list.count(), tracker.ledger().frames_stored);
  }

  LossTracker tracker;
  FrameList list;
};

TEST(LossLedger, NothingLostNothingBooked) {
  Tracking t;
  for (std::uint64_t i = 0; i < 10; ++i) t.take({.first = 1000 + 16 * i});
  EXPECT_EQ(t.tracker.ledger().frames_stored, 160u);
  EXPECT_EQ(t.tracker.ledger().first_sequence, 1000u);
  EXPECT_EQ(t.tracker.ledger().board_rate_hz, 1000);
  EXPECT_TRUE(t.list.gaps.empty());
  for (std::size_t i = 0; i < 160; ++i) EXPECT_EQ(t.list.samples[4 * i], test::sample_of(1000 + i, 0));
}

TEST(LossLedger, AJumpIsAGapWithItsLengthAndCause) {
  Tracking t;
  t.take({.first = 0});
  t.take({.first = 48});
  t.take({.first = 100, .first_status = TRW_STATUS_OVERRUN});
  t.take({.first = 120, .first_status = TRW_STATUS_ADC_ERROR});
  t.take({.first = 140, .first_status = TRW_STATUS_ADC_ERROR | TRW_STATUS_OVERRUN});
  ASSERT_EQ(t.list.gaps.size(), 4u);
  EXPECT_EQ(t.list.gaps[0], (Gap{16, 32, "lost", false}));
  EXPECT_EQ(t.list.gaps[1], (Gap{32, 36, "overrun", false}));
  EXPECT_EQ(t.list.gaps[2], (Gap{48, 4, "adc-error", false}));
  EXPECT_EQ(t.list.gaps[3], (Gap{64, 4, "overrun", false})) << "both";
  EXPECT_EQ(t.tracker.ledger().frames_overrun, 2u);
}

TEST(LossLedger, CountsWhatTheBoardFlags) {
  Tracking t;
  t.take({.first = 0, .first_status = 0x0005});
  t.take({.first = 16, .first_status = TRW_STATUS_TEST_PATTERN});
  t.take({.first = 32, .first_status = TRW_STATUS_TEST_PATTERN | 0x0008});
  EXPECT_EQ(t.tracker.ledger().frames_clipped, 2u);
  EXPECT_EQ(t.tracker.ledger().frames_test_pattern, 2u);
  EXPECT_EQ(t.tracker.ledger().frames_adc_error, 0u);
}

TEST(LossLedger, ARunHasOneRate) {
  for (const std::uint32_t boot : {1u, 2u}) {
    Tracking t;
    t.take({.first = 0});
    t.take({.first = 16, .ticks_per_frame = 84010});
    EXPECT_FALSE(t.tracker.changed_rate_hz()) << "a device that measures its period";
    t.take({.first = 32, .boot = boot, .ticks_per_frame = 63000});
    EXPECT_NEAR(t.tracker.changed_rate_hz().value(), 4000.0 / 3, 1e-9);
    t.take({.first = 48});
    EXPECT_EQ(t.tracker.ledger().frames_stored, 32u);
    EXPECT_EQ(t.tracker.ledger().frames_lost, 0u);
  }
}

TEST(LossLedger, DuplicatesAndLateFramesAreToldApartAndDropped) {
  Tracking t;
  t.take({.first = 0});
  t.take({.first = 0});   // again
  t.take({.first = 32});  // 16…31 missing
  t.take({.first = 16});  // there they are, too late
  t.take({.first = 40});  // half known, half new
  EXPECT_EQ(t.tracker.ledger().frames_duplicate, 16u + 8u);
  EXPECT_EQ(t.tracker.ledger().frames_late, 16u);
  EXPECT_EQ(t.tracker.ledger().frames_lost, 16u);
  EXPECT_EQ(t.tracker.ledger().frames_stored, 16u + 16u + 8u);
  EXPECT_EQ(t.list.samples.back(), test::sample_of(55, 3));
}

TEST(LossLedger, ALateFrameIsLateOnceAndThenADuplicate) {
  Tracking t;
  t.take({.first = 0});
  t.take({.first = 48});
  for (int copy = 0; copy < 3; ++copy) t.take({.first = 24});  // the middle of the gap, three times
  EXPECT_EQ(t.tracker.ledger().frames_late, 16u);
  EXPECT_EQ(t.tracker.ledger().frames_duplicate, 32u);
  t.take({.first = 16, .count = 8});
  t.take({.first = 40, .count = 8});
  EXPECT_EQ(t.tracker.ledger().frames_late, 32u) << "both ends of the gap are still open";
  EXPECT_EQ(t.tracker.ledger().frames_lost, 32u);
}

TEST(LossLedger, TheNewest256GapsAreRemembered) {
  Tracking t;
  for (std::uint64_t i = 0; i <= 257; ++i) t.take({.first = 32 * i});
  t.take({.first = 16});  // the oldest of 257 gaps
  EXPECT_EQ(t.tracker.ledger().frames_duplicate, 16u);
  t.take({.first = 48});
  EXPECT_EQ(t.tracker.ledger().frames_late, 16u);
}

TEST(LossLedger, ARebootIsAGapNotARestart) {
  Tracking t;
  t.take({.first = 5000, .boot = 7}, 10.000);
  t.take({.first = 32, .boot = 8}, 10.500);  // 0.5 s at 1000 frames/s, 16 of them in the packet
  ASSERT_EQ(t.list.gaps.size(), 1u);
  EXPECT_EQ(t.list.gaps[0], (Gap{16, 484, "reboot", true}));
  EXPECT_EQ(t.tracker.ledger().reboots, 1u);
  t.take({.first = 5016, .boot = 7}, 10.6);  // a straggler from before
  EXPECT_EQ(t.tracker.ledger().frames_late, 16u);
  t.take({.first = 48, .boot = 8}, 10.6);
  EXPECT_EQ(t.list.gaps.size(), 1u);
}

TEST(LossLedger, ARestartUnderTheOldBootIdIsKnownByItsFrames) {
  Tracking t;
  for (std::uint64_t i = 0; i < 50; ++i) t.take({.first = 16 * i}, 0.016 * static_cast<double>(i));
  for (std::uint64_t i = 0; i < 60; ++i)
    t.take({.first = 16 * i, .sampled = 1000}, 1.284 + 0.016 * static_cast<double>(i));
  const Ledger& ledger = t.tracker.ledger();
  EXPECT_EQ(ledger.reboots, 1u);
  EXPECT_EQ(ledger.frames_duplicate, 0u);
  EXPECT_EQ(ledger.packets_corrupt, 0u);
  ASSERT_EQ(t.list.gaps.size(), 1u);
  EXPECT_EQ(t.list.gaps[0], (Gap{800, 500, "reboot", true})) << "from 0.784 s to 1.300 s, a packet of it new";
  EXPECT_EQ(t.list.count(), 800u + 59u * 16u);
  EXPECT_EQ(t.list.samples[4 * 800], test::sample_of(1016, 0));
  t.take({.first = 32, .sampled = 1000});
  EXPECT_EQ(ledger.frames_duplicate, 16u) << "of the new count";
}

TEST(LossLedger, ARestartBelowAllThatIsRememberedIsKnownToo) {
  Tracking t;
  t.take({.first = 1000000});
  t.take({.first = 0});
  t.take({.first = 16});
  EXPECT_EQ(t.tracker.ledger().reboots, 1u);
  EXPECT_EQ(t.list.gaps.at(0), (Gap{16, 16, "reboot", true}));
}

TEST(LossLedger, ARestartIntoNumbersFromBeforeTheRunIsKnownByTheTime) {
  Tracking t;
  t.take({.first = 50000}, 10.0);
  t.take({.first = 0, .sampled = 1000}, 11.016);
  t.take({.first = 16, .sampled = 1000}, 11.032);
  EXPECT_EQ(t.tracker.ledger().reboots, 1u);
  EXPECT_EQ(t.tracker.ledger().frames_duplicate, 0u);
  EXPECT_EQ(t.list.gaps.at(0), (Gap{16, 1016, "reboot", true}));
}

TEST(LossLedger, FramesFromBeforeTheRunThatALinkSendsAgainAreNoRestart) {
  Tracking t;
  t.take({.first = 50000}, 10.0);
  for (std::uint64_t first = 49040; first <= 50016; first += 16) t.take({.first = first}, 10.5);
  EXPECT_EQ(t.tracker.ledger().reboots, 0u);
  EXPECT_EQ(t.tracker.ledger().frames_lost, 0u);
  EXPECT_EQ(t.list.count(), 32u);
}

TEST(LossLedger, OneContradictingPacketDoesNotMoveTheCount) {
  Tracking t;
  for (std::uint64_t i = 0; i < 4; ++i) t.take({.first = 16 * i});
  t.take({.first = 0, .sampled = 5});
  t.take({.first = 64});
  EXPECT_EQ(t.tracker.ledger().packets_corrupt, 1u);
  EXPECT_EQ(t.tracker.ledger().reboots, 0u);
  EXPECT_EQ(t.tracker.ledger().frames_lost, 0u);
  EXPECT_EQ(t.list.count(), 80u);
}

TEST(LossLedger, WhatALinkSendsAgainInOneGoIsNoRestart) {
  Tracking t;
  for (std::uint64_t i = 0; i < 50; ++i) t.take({.first = 16 * i});
  for (std::uint64_t i = 10; i < 60; ++i) t.take({.first = 16 * i});
  EXPECT_EQ(t.tracker.ledger().reboots, 0u);
  EXPECT_EQ(t.tracker.ledger().frames_duplicate, 640u);
  EXPECT_EQ(t.list.count(), 960u);
}

TEST(LossLedger, WithoutAClockARebootCountsWhatIsCertain) {
  Tracking t;
  t.take({.first = 5000, .boot = 7});
  t.take({.first = 32, .boot = 8});
  EXPECT_EQ(t.list.gaps[0].frames_lost, 32u);
}

TEST(LossLedger, EndsAtTheWantedNumberOfFrames) {
  Tracking exact(40);
  for (std::uint64_t i = 0; i < 4; ++i) exact.take({.first = 16 * i});
  EXPECT_TRUE(exact.tracker.complete());
  EXPECT_EQ(exact.list.count(), 40u);

  Tracking lost(40);
  lost.take({.first = 0});
  lost.take({.first = 1000});  // the end of the run lies in the gap
  EXPECT_TRUE(lost.tracker.complete());
  EXPECT_EQ(lost.tracker.ledger().frames_lost, 24u);
  EXPECT_EQ(lost.list.count(), 16u);
}

TEST(LossLedger, AbsurdNumbersAreNotBelieved) {
  Tracking t;
  t.take({.first = 0});
  t.take({.first = std::uint64_t{1} << 50});
  t.take({.first = ~std::uint64_t{0} - 3});
  EXPECT_EQ(t.tracker.ledger().packets_corrupt, 2u);
  EXPECT_EQ(t.tracker.ledger().frames_lost, 0u);
  t.take({.first = 16});
  EXPECT_EQ(t.tracker.ledger().frames_stored, 32u);
  t.take({.first = std::uint64_t{1} << 50, .boot = 2});
  EXPECT_EQ(t.tracker.ledger().packets_corrupt, 3u);
  EXPECT_EQ(t.tracker.ledger().reboots, 0u);
  t.take({.first = 32});
  EXPECT_EQ(t.tracker.ledger().frames_stored, 48u) << "the boot under way goes on";
}

}  // namespace
}  // namespace tunnelrig
