// The virtual board suffers every fault there is; the ledger must account for every frame that it sampled.
#include "daq/faults.h"
#include "daq/logging.h"
#include "daq/packets.h"
#include "daq/virtual_board.h"
#include "datasets/error.h"
#include "support/message_of.h"
#include "support/seeds.h"

#include <map>
#include <random>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

constexpr double kRate_hz = 4000.0 / 3.0;

struct Logged {
  LogOutcome outcome;
  std::vector<std::int16_t> samples;
  std::vector<Gap> gaps;
};

/// Logs `duration_s` from a board of recognisable frames that suffers `faults`.
Logged log_with(const std::string& faults, double duration_s, std::uint64_t seed) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  std::uint64_t next = 0;
  VirtualBoard board({.frame_rate_hz = kRate_hz, .seed = seed, .faults = parse_faults(faults)}, [&next] {
    trw_frame frame{};
    for (std::size_t c = 0; c < 4; ++c) frame.sample[c] = test::sample_of(next, c);
    ++next;
    return frame;
  });
  Logged logged;
  logged.outcome = log_run(board, file, test::cells("R1"), {.duration_s = duration_s}, test::summarizer(), {},
                           test::never_stop());
  const RawRun run = raw_run(file, "R1").value();
  test::FrameList list;
  read_raw(file, run, list);
  logged.samples = list.samples;
  logged.gaps = list.gaps;
  EXPECT_EQ(file.integrity_problems(), "");
  EXPECT_EQ(list.count(), logged.outcome.ledger.frames_stored);
  EXPECT_EQ(ledger_of(file, run.id)->frames_emitted, logged.outcome.ledger.frames_emitted);
  return logged;
}

/// Without a reboot every stored frame can be told by its content: it must be the one whose place it takes.
void expect_every_frame_in_its_place(const Logged& logged) {
  std::map<std::uint64_t, std::uint64_t> lost_before;
  for (const Gap& gap : logged.gaps) lost_before[gap.first_frame] += gap.frames_lost;
  std::uint64_t sequence = logged.outcome.ledger.first_sequence;
  for (std::size_t i = 0; i < logged.samples.size() / 4; ++i, ++sequence) {
    if (const auto gap = lost_before.find(i); gap != lost_before.end()) sequence += gap->second;
    for (std::size_t c = 0; c < 4; ++c) {
      ASSERT_EQ(logged.samples[4 * i + c], test::sample_of(sequence, c)) << "stored frame " << i;
    }
  }
}

class Faulty : public testing::TestWithParam<const char*> {};

TEST_P(Faulty, EveryFrameIsAccountedFor) {
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  const double duration_s = 60;
  const Logged logged = log_with(GetParam(), duration_s, seed);
  const Ledger& ledger = logged.outcome.ledger;
  EXPECT_EQ(logged.outcome.state, RunState::kComplete);
  EXPECT_EQ(ledger.frames_emitted, static_cast<std::uint64_t>(duration_s * kRate_hz));
  EXPECT_TRUE(ledger.closed());
  std::uint64_t in_gaps = 0;
  for (const Gap& gap : logged.gaps) in_gaps += gap.frames_lost;
  EXPECT_EQ(in_gaps, ledger.frames_lost);
  expect_every_frame_in_its_place(logged);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, Faulty,
    testing::Values(
        "", "drop=0.05", "duplicate=0.05", "reorder=0.05", "corrupt=0.05", "truncate=0.05", "garbage=0.2",
        "stall=10:2", "stall=10:8",
        "drop=0.02,duplicate=0.02,reorder=0.02,corrupt=0.02,truncate=0.02,garbage=0.05,stall=20:5"));

TEST(Faults, DropsAreLossesAndDuplicatesAreNot) {
  EXPECT_GT(log_with("drop=0.05", 30, 1).outcome.ledger.frames_lost, 0u);
  const Ledger twice = log_with("duplicate=0.05", 30, 1).outcome.ledger;
  EXPECT_EQ(twice.frames_lost, 0u);
  EXPECT_GT(twice.frames_duplicate, 0u);
  const Ledger swapped = log_with("reorder=0.05", 30, 1).outcome.ledger;
  EXPECT_GT(swapped.frames_late, 0u);
  EXPECT_GE(swapped.frames_lost, swapped.frames_late);
  EXPECT_GT(log_with("corrupt=0.05", 30, 1).outcome.ledger.packets_corrupt, 0u);
}

TEST(Faults, AShortStallLosesNothingALongOneOverruns) {
  EXPECT_EQ(log_with("stall=5:2", 20, 1).outcome.ledger.frames_lost, 0u);  // the board's ring holds 3 s
  const Logged overrun = log_with("stall=5:6", 20, 1);
  ASSERT_EQ(overrun.gaps.size(), 1u);
  EXPECT_EQ(overrun.gaps[0].cause, "overrun");
  EXPECT_NEAR(static_cast<double>(overrun.gaps[0].frames_lost), 3 * kRate_hz, 40);
  EXPECT_GE(overrun.outcome.ledger.silences, 1u);
}

TEST(Faults, TheBoardCountsTheFramesThatItLost) {
  VirtualBoard board({.frame_rate_hz = kRate_hz, .faults = parse_faults("stall=5:6")},
                     [] { return trw_frame{}; });
  test::PacketList packets;
  PacketDecoder decoder;
  std::vector<std::byte> bytes(4096);
  while (static_cast<double>(board.frames_sampled()) < 20 * kRate_hz)
    decoder.push(std::span(bytes).first(board.read(bytes, std::chrono::milliseconds(50)).size), packets);
  std::uint64_t next = 0, lost = 0;
  for (const auto& seen : packets.seen) {
    lost += seen.header.first_sequence - next;
    next = seen.header.first_sequence + seen.header.frame_count;
  }
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(packets.seen.back().header.overruns, lost);
}

TEST(Faults, ARebootIsAGapOfTheRightLength) {
  const Logged logged = log_with("reboot=10:0.8", 30, 1);
  ASSERT_EQ(logged.gaps.size(), 1u);
  EXPECT_EQ(logged.gaps[0].cause, "reboot");
  EXPECT_TRUE(logged.gaps[0].estimated);
  EXPECT_NEAR(static_cast<double>(logged.gaps[0].frames_lost), 0.8 * kRate_hz, 0.06 * kRate_hz);
  EXPECT_EQ(logged.outcome.ledger.reboots, 1u);
  EXPECT_EQ(logged.outcome.state, RunState::kComplete);
}

TEST(Faults, ADeadSourceEndsTheRunAsPartial) {
  const Logged logged = log_with("stall=5:1000", 60, 1);
  EXPECT_EQ(logged.outcome.state, RunState::kPartial);
  EXPECT_EQ(logged.outcome.ledger.end_reason, "no frame for 30 s");
  EXPECT_TRUE(logged.outcome.ledger.closed());
}

TEST(Faults, OptionTextIsChecked) {
  EXPECT_NE(test::message_of([] { parse_faults("drop=2"); }).find("a number from 0 to 1"), std::string::npos);
  EXPECT_NE(test::message_of([] { parse_faults("explode=1"); }).find("none of drop"), std::string::npos);
  EXPECT_EQ(parse_faults("stall=10:2.5").stall_s, 2.5);
  for (const char* without : {"stall=1", "reboot=1"})
    EXPECT_NE(test::message_of([&] { parse_faults(without); }).find("when and for how long"),
              std::string::npos);
}

}  // namespace
}  // namespace tunnelrig
