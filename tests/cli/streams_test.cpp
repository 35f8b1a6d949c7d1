// What `log` says of streams that are not as docs/wire-format.md wants them.
#include "cli/program.h"
#include "daq/packets.h"
#include "datasets/csv.h"
#include "datasets/raw_store.h"
#include "support/temporary_folder.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::ProgramResult;
using testing::HasSubstr;
using testing::Not;

struct Streams : testing::Test {
  test::TemporaryFolder folder;
  std::string bytes;

  void add(const test::PacketSpec& spec) {
    const auto packet = test::packet_bytes(spec);
    bytes.append(reinterpret_cast<const char*>(packet.data()), packet.size());
  }
  ProgramResult log(const std::string& duration, const std::string& location = "OT") const {
    std::ofstream(folder / "bytes", std::ios::binary) << bytes;
    return test::run_program(
        folder.path(), "log --db c.db --session S1 --temperature-C 20 --source replay:bytes --location " +
                           location + " --duration " + duration);
  }
};

TEST_F(Streams, ARestartUnderTheOldBootIdIsAGap) {
  for (std::uint64_t i = 0; i < 50; ++i) add({.first = 16 * i, .ticks_per_frame = 63000});
  for (std::uint64_t i = 0; i < 60; ++i) add({.first = 16 * i, .ticks_per_frame = 63000, .sampled = 1000});
  const ProgramResult result = log("1");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.out, HasSubstr(": 1317 frames, 16 lost"));
  EXPECT_THAT(result.error, HasSubstr("0 late, 0 corrupt packets, 1 reboots"));
}

TEST_F(Streams, ARestartThatRepeatsItselfToTheBitIsNotSilent) {
  for (const std::uint64_t packets : {50u, 60u})
    for (std::uint64_t i = 0; i < packets; ++i) add({.first = 16 * i, .ticks_per_frame = 63000});
  EXPECT_THAT(log("0.65").error, HasSubstr("run R0001: 800 frames came under numbers that had passed"));
}

/// One try, as without a page; the limit is what a loop would run into.
TEST_F(Streams, APlanThatNobodyWatchesOverADeadBoardEnds) {
  std::ofstream(folder / "plan.csv") << "session,location,repeat,duration_s\nS1,OT,1,1\nS1,OT,2,1\n";
  const std::string log = "log --db c.db --plan plan.csv --yes --speed max --faults stall=0:100000";
  for (const std::string page : {"", " --live 0"}) {
    const ProgramResult result = test::run_program(folder.path(), log + page, "ulimit -t 10");
    EXPECT_EQ(result.code, 1) << page;
    EXPECT_THAT(result.error, HasSubstr("is partial: no frame for 30 s")) << page;
  }
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  EXPECT_EQ(raw_runs(file).size(), 4u);
}

TEST_F(Streams, WhatIsReplayedIsNotCapturedOverItself) {
  for (std::uint64_t i = 0; i < 50; ++i) add({.first = 16 * i, .ticks_per_frame = 63000});
  const ProgramResult result = log("0.6 --capture ./bytes");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, HasSubstr("--capture ./bytes: this is what --source replays"));
  EXPECT_EQ(read_text(folder / "bytes"), bytes);
}

TEST_F(Streams, RefusedPacketsAreSaidEvenWhereNothingIsLost) {
  for (const std::uint64_t first : {std::uint64_t{0}, std::uint64_t{1} << 50, std::uint64_t{16}})
    add({.first = first, .ticks_per_frame = 63000});
  const ProgramResult result = log("0.024");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.out, HasSubstr(": 32 frames, 0 lost"));
  EXPECT_THAT(result.error, HasSubstr("run R0001: 1 packet was refused"));
}

TEST_F(Streams, ABoardThatSaysNoRateIsSaid) {
  for (std::uint64_t i = 0; i < 50; ++i) add({.first = 16 * i, .ticks_per_frame = 0});
  const ProgramResult result = log("0.6");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.error, HasSubstr("run R0001: the board says no rate"));
}

TEST_F(Streams, AnotherRateThanTheCampaignsIsSaidWithItsSeconds) {
  for (std::uint64_t i = 0; i < 100; ++i) add({.first = 16 * i, .ticks_per_frame = 42000});
  const ProgramResult result = log("0.6");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.out, HasSubstr(": 1200 frames, 0 lost")) << "0.6 s of the board's 2000 Hz";
  EXPECT_THAT(result.error, HasSubstr("by the board the run is 0.600 s long"));
}

TEST_F(Streams, WithoutAPacketNoChannelIsStuck) {
  bytes = "a board of another make, perhaps";
  const ProgramResult result = log("1");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.out, HasSubstr("0 frames, 0 lost, no frames"));
  EXPECT_THAT(result.error, HasSubstr("run R0001: 32 bytes arrived that are no packets of version 1"));
  EXPECT_THAT(result.error, Not(HasSubstr("stuck")));
}

TEST_F(Streams, ALocationThatNoMapHasIsSaid) {
  for (std::uint64_t i = 0; i < 50; ++i) add({.first = 16 * i, .ticks_per_frame = 63000});
  EXPECT_THAT(log("0.6", "H9V9").error, HasSubstr("location 'H9V9' is none of the tunnel's grid"));
  EXPECT_THAT(log("0.6", "GND2").error, Not(HasSubstr("none of the tunnel's grid")));
}

}  // namespace
}  // namespace tunnelrig
