// What a kill, a full disk and an impatient user do to a run.
#include "daq/logger.h"

#include "daq/logging.h"
#include "daq/packets.h"
#include "daq/virtual_board.h"
#include "datasets/error.h"
#include "datasets/sqlite.h"
#include "datasets/statistics_store.h"
#include "support/wall_clock.h"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <thread>

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

constexpr double kRate_hz = 4000.0 / 3.0;

VirtualBoard counting_board(double pace) {
  auto next = std::make_shared<std::uint64_t>(0);
  return VirtualBoard({.frame_rate_hz = kRate_hz, .pace = pace}, [next] {
    trw_frame frame{};
    for (std::size_t c = 0; c < 4; ++c) frame.sample[c] = test::sample_of(*next, c);
    ++*next;
    return frame;
  });
}

TEST(Logger, StoresExactlyTheRun) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  VirtualBoard board = counting_board(0);
  double last_elapsed = -1;
  std::ofstream bytes(folder / "bytes", std::ios::binary);
  const LogOutcome outcome = log_run(
      board, file, test::cells("R1"), {.duration_s = 12, .capture = &bytes}, test::summarizer(),
      [&](const LogProgress& progress) { last_elapsed = progress.elapsed_s; }, test::never_stop());
  EXPECT_TRUE(bytes);
  EXPECT_EQ(outcome.state, RunState::kComplete);
  EXPECT_EQ(outcome.ledger.frames_stored, 16000u);
  EXPECT_EQ(outcome.ledger.source, "virtual");
  EXPECT_NEAR(last_elapsed, 12, 1e-9);
  EXPECT_EQ(file.runs().at(0).run, "R1");
  EXPECT_EQ(all_statistics(file).at(raw_run(file, "R1")->id).hash, raw_run(file, "R1")->hash);

  // and the captured bytes replay to the same run
  const auto replay = open_source("replay:" + (folder / "bytes").string());
  log_run(*replay, file, test::cells("R2"), {.duration_s = 12}, test::summarizer(), {}, test::never_stop());
  EXPECT_EQ(raw_run(file, "R2")->hash, raw_run(file, "R1")->hash);
}

TEST(Logger, UserMayStopARun) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  VirtualBoard board = counting_board(1);
  std::atomic<bool> stop{false};
  std::thread user([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
    stop = true;
  });
  const LogOutcome outcome =
      log_run(board, file, test::cells("R1"), {.duration_s = 60}, test::summarizer(), {}, stop);
  user.join();
  EXPECT_EQ(outcome.state, RunState::kPartial);
  EXPECT_EQ(outcome.ledger.end_reason, "stopped by the user");
  if (test::kClockCounts) {
    EXPECT_NEAR(static_cast<double>(outcome.ledger.frames_stored), 0.6 * kRate_hz, 0.3 * kRate_hz);
  }
}

/// A packet of 16 frames whenever they are due, on a clock of its own that every look moves on by 0.2 s.
class SlowBoard : public PacketSource {
 public:
  explicit SlowBoard(std::uint32_t ticks_per_frame) : ticks_per_frame_(ticks_per_frame) {}
  ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds) override {
    time_s_ += 0.2;
    if (time_s_ < static_cast<double>((next_ + 16) * ticks_per_frame_) / 84e6)
      return {ReadResult::Status::kNothing, 0, time_s_};
    const auto bytes = test::packet_bytes({.first = next_, .ticks_per_frame = ticks_per_frame_});
    std::copy(bytes.begin(), bytes.end(), buffer.begin());
    next_ += 16;
    return {ReadResult::Status::kData, bytes.size(), time_s_};
  }
  bool reopen() override {
    ++reopened;
    return true;
  }
  std::string name() const override { return "slow"; }
  int reopened = 0;

 private:
  std::uint32_t ticks_per_frame_;
  std::uint64_t next_ = 0;
  double time_s_ = 0;
};

TEST(Logger, ASlowBoardIsNotASilentOne) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  SlowBoard board(8400000);  // 10 frames/s, a packet every 1.6 s
  const LogOutcome outcome = log_run(board, file, test::cells("R1"), {.duration_s = 160 / kRate_hz},
                                     test::summarizer(), {}, test::never_stop());
  EXPECT_EQ(outcome.state, RunState::kComplete);
  EXPECT_LE(board.reopened, 1) << "before its first packet nobody knows how slow it is";
  EXPECT_LE(outcome.ledger.silences, 1u);
}

/// A board that starts anew whenever it is opened, and takes its time.
class StartingBoard : public PacketSource {
 public:
  ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds) override {
    time_s_ += 0.05;
    if (time_s_ - opened_s_ < 2.5) return {ReadResult::Status::kNothing, 0, time_s_};
    const auto bytes = test::packet_bytes({.first = next_});
    std::copy(bytes.begin(), bytes.end(), buffer.begin());
    next_ += 16;
    return {ReadResult::Status::kData, bytes.size(), time_s_};
  }
  bool reopen() override {
    opened_s_ = time_s_;
    return true;
  }
  std::string name() const override { return "starting"; }

 private:
  std::uint64_t next_ = 0;
  double time_s_ = 0, opened_s_ = 0;
};

TEST(Logger, ABoardIsLeftTheTimeToStart) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  StartingBoard board;
  const LogOutcome outcome = log_run(board, file, test::cells("R1"), {.duration_s = 160 / kRate_hz},
                                     test::summarizer(), {}, test::never_stop());
  EXPECT_EQ(outcome.state, RunState::kComplete) << outcome.ledger.end_reason;
}

TEST(Logger, ARunEndsWhereTheRateChanges) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  {
    std::ofstream bytes(folder / "bytes", std::ios::binary);
    for (const test::PacketSpec& spec :
         {test::PacketSpec{.first = 0}, test::PacketSpec{.first = 16, .ticks_per_frame = 63000}}) {
      const auto packet = test::packet_bytes(spec);
      bytes.write(reinterpret_cast<const char*>(packet.data()), static_cast<std::streamsize>(packet.size()));
    }
  }
  const auto replay = open_source("replay:" + (folder / "bytes").string());
  const LogOutcome outcome = log_run(*replay, file, test::cells("R1"), {.duration_s = 12}, test::summarizer(),
                                     {}, test::never_stop());
  EXPECT_EQ(outcome.state, RunState::kPartial);
  EXPECT_EQ(outcome.ledger.end_reason, "the board's rate changed to 1333.333 frames/s");
  EXPECT_EQ(outcome.ledger.frames_stored, 16u);
}

TEST(Logger, SecondsAreTheBoardsWhereItsRateIsAnother) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  VirtualBoard board({.frame_rate_hz = 2000, .pace = 0}, [] { return trw_frame{}; });
  double last_elapsed_s = -1;
  const LogOutcome outcome = log_run(
      board, file, test::cells("R1"), {.duration_s = 3}, test::summarizer(),
      [&](const LogProgress& progress) { last_elapsed_s = progress.elapsed_s; }, test::never_stop());
  EXPECT_EQ(outcome.ledger.frames_emitted, 6000u);
  EXPECT_NEAR(last_elapsed_s, 3, 1e-9);
}

/// Sixteen frames, then whatever it is given, for ever.
class StrayBoard : public PacketSource {
 public:
  explicit StrayBoard(std::vector<std::byte> stray) : stray_(std::move(stray)) {}
  ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds) override {
    const auto bytes = time_s_ == 0 ? test::packet_bytes({.first = 0}) : stray_;
    time_s_ += 0.5;
    std::copy(bytes.begin(), bytes.end(), buffer.begin());
    return {ReadResult::Status::kData, bytes.size(), time_s_};
  }
  bool reopen() override { return true; }
  std::string name() const override { return "stray"; }

 private:
  std::vector<std::byte> stray_;
  double time_s_ = 0;
};

TEST(Logger, SaysWhatArrivesInsteadOfFrames) {
  for (const auto& [stray, text] :
       {std::pair(test::packet_bytes({.first = std::uint64_t{1} << 50}), "packets with a wrong checksum"),
        {test::packet_bytes({.first = 0}), "frames whose numbers have passed"},
        {std::vector<std::byte>(100, std::byte{7}), "bytes that are no packets of version 1"}}) {
    const test::TemporaryFolder folder;
    CampaignFile file = test::new_campaign(folder / "c.db");
    StrayBoard board(stray);
    std::string instead;
    const LogOutcome outcome = log_run(
        board, file, test::cells("R1"), {.duration_s = 12}, test::summarizer(),
        [&](const LogProgress& progress) { instead = progress.instead; }, test::never_stop());
    EXPECT_NE(outcome.ledger.end_reason.find("no new frame for 30 s, only "), std::string::npos);
    EXPECT_NE(outcome.ledger.end_reason.find(text), std::string::npos) << outcome.ledger.end_reason;
    EXPECT_NE(instead.find(text), std::string::npos) << instead;
  }
}

TEST(Logger, ARunIsNotRecordedTwice) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  for (const bool first : {true, false}) {
    VirtualBoard board = counting_board(0);
    const auto log = [&] {
      log_run(board, file, test::cells("R1"), {.duration_s = 1}, test::summarizer(), {}, test::never_stop());
    };
    if (first) {
      log();
    } else {
      EXPECT_THROW(log(), InputError);
    }
  }
  EXPECT_EQ(file.runs().size(), 1u) << "the refused run left a row behind";
}

TEST(Logger, ARunHasAFrame) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  VirtualBoard board = counting_board(0);
  const LogOutcome outcome = log_run(board, file, test::cells("R1"), {.duration_s = 0.0003},
                                     test::summarizer(), {}, test::never_stop());
  EXPECT_EQ(outcome.state, RunState::kComplete);
  EXPECT_EQ(outcome.ledger.frames_stored, 1u);
}

TEST(Logger, ACaptureThatCannotBeWrittenCostsNoRecording) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  VirtualBoard board = counting_board(0);
  std::ofstream full("/dev/full", std::ios::binary);
  const LogOutcome outcome = log_run(board, file, test::cells("R1"), {.duration_s = 2, .capture = &full},
                                     test::summarizer(), {}, test::never_stop());
  EXPECT_FALSE(full);
  EXPECT_EQ(outcome.state, RunState::kComplete);
}

/// SQLite gives up after five seconds. A recorder waits, with the frames, until the other has written.
TEST(Logger, AnotherProgramThatHoldsTheFileCostsNothing) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const Database other((folder / "c.db").string(), SQLITE_OPEN_READWRITE);
  std::optional<Transaction> writing(other);
  bool waiting = false, held_up = false;
  const auto hold_to_beyond_the_end = [&](const LogProgress& progress) {
    if (progress.waiting) {
      waiting = true;
      writing.reset();
    }
    if (held_up || progress.waiting) return;
    if (!writing) writing.emplace(other);
    held_up = progress.held_up && progress.elapsed_s > progress.duration_s - 0.01;
    if (held_up) writing.reset();
  };
  VirtualBoard board = counting_board(1);
  const LogOutcome outcome = log_run(board, file, test::cells("R1"), {.duration_s = 1.5}, test::summarizer(),
                                     hold_to_beyond_the_end, test::never_stop());
  EXPECT_TRUE(waiting && held_up);
  EXPECT_EQ(outcome.state, RunState::kComplete);
  EXPECT_EQ(outcome.ledger.frames_lost, 0u);
  test::FrameList list;
  read_raw(file, raw_run(file, "R1").value(), list);
  ASSERT_EQ(list.count(), 2000u);
  for (std::size_t i = 0; i < list.count(); ++i) ASSERT_EQ(list.samples[4 * i], test::sample_of(i, 0));
}

TEST(Logger, ARunThatWaitsToBeginCanBeStopped) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const Database other((folder / "c.db").string(), SQLITE_OPEN_READWRITE);
  const Transaction writing(other);
  std::atomic<bool> stop{false};
  VirtualBoard board = counting_board(1);
  const auto stop_it = [&](const LogProgress& progress) { stop = progress.waiting; };
  EXPECT_THROW(log_run(board, file, test::cells("R1"), {.duration_s = 1}, test::summarizer(), stop_it, stop),
               InputError);
}

/// Counts in shared memory what the sink was given, so that the parent knows what the child had received when
/// it died.
TEST(Logger, AKillCostsAtMostTheLastTenthOfASecond) {
  const unsigned seed = static_cast<unsigned>(::getpid());
  SCOPED_TRACE(seed);
  std::srand(seed);
  for (int round = 0; round < 6; ++round) {
    const test::TemporaryFolder folder;
    const auto path = folder / "c.db";
    const pid_t child = ::fork();
    if (child == 0) {
      CampaignFile file = test::new_campaign(path);
      VirtualBoard board = counting_board(1);
      log_run(board, file, test::cells("R1"), {.duration_s = 60}, test::summarizer(), {}, test::never_stop());
      ::_exit(0);
    }
    // The board starts within a few milliseconds of the run's row; from then on its clock is ours.
    double started_s = 0;
    while (started_s == 0) {
      try {
        const CampaignFile reader(path, CampaignFile::Access::kRead);
        if (raw_run(reader, "R1")) started_s = steady_seconds();
      } catch (const std::exception&) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300 + std::rand() % 700));
    const double lived_s = steady_seconds() - started_s;
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));

    CampaignFile file(path, CampaignFile::Access::kRecord);  // the lock went with the process
    EXPECT_EQ(file.integrity_problems(), "");
    EXPECT_EQ(close_interrupted_runs(file), std::vector<std::string>{"R1"});
    const RawRun run = raw_run(file, "R1").value();
    EXPECT_EQ(run.state, RunState::kPartial);
    test::FrameList list;
    read_raw(file, run, list);
    for (std::size_t i = 0; i < list.count(); ++i) ASSERT_EQ(list.samples[4 * i], test::sample_of(i, 0));
    EXPECT_TRUE(ledger_of(file, run.id)->closed());
    // 12 ms are one packet, which a board cannot send before it is full; the rest is scheduling.
    if (test::kClockCounts) {
      EXPECT_GE(static_cast<double>(list.count()) / kRate_hz, lived_s - 0.100 - 0.012 - 0.050)
          << "after " << lived_s << " s";
    }
  }
}

/// A small file system of its own, or a skipped test where one may not be mounted.
class SmallDisk {
 public:
  SmallDisk(const std::filesystem::path& where, const char* size) : where_(where) {
    std::filesystem::create_directory(where);
    mounted_ = ::mount("tmpfs", where.c_str(), "tmpfs", 0, size) == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(where_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }

 private:
  std::filesystem::path where_;
  bool mounted_ = false;
};

TEST(Logger, AFullDiskEndsTheRunAndKeepsWhatCameBefore) {
  const test::TemporaryFolder folder;
  const SmallDisk disk(folder / "disk", "size=3m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting a small file system needs root";
  const auto path = folder / "disk" / "c.db";
  {
    CampaignFile file = test::new_campaign(path);
    VirtualBoard board = counting_board(0);
    try {
      log_run(board, file, test::cells("R1"),
              {.duration_s = 3600, .commit_interval = std::chrono::milliseconds(5)}, test::summarizer(), {},
              test::never_stop());
      FAIL() << "38 MB went onto a disk of 3 MB";
    } catch (const StorageError& error) {
      EXPECT_TRUE(error.disk_full()) << error.what();
    }
  }
  // The reader of what is left needs a little room for SQLite's own index of the journal.
  ASSERT_EQ(::mount("tmpfs", (folder / "disk").c_str(), "tmpfs", MS_REMOUNT, "size=8m"), 0);
  CampaignFile file(path, CampaignFile::Access::kRecord);
  EXPECT_EQ(file.integrity_problems(), "");
  EXPECT_EQ(close_interrupted_runs(file), std::vector<std::string>{"R1"});
  const RawRun run = raw_run(file, "R1").value();
  EXPECT_GT(run.frames, 1000u);
  test::FrameList list;
  read_raw(file, run, list);
  for (std::size_t i = 0; i < list.count(); ++i) ASSERT_EQ(list.samples[4 * i], test::sample_of(i, 0));
}

}  // namespace
}  // namespace tunnelrig
