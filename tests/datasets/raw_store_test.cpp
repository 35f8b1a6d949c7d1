#include "datasets/raw_store.h"

#include "datasets/error.h"
#include "datasets/raw_key.h"
#include "datasets/snapshot.h"
#include "datasets/sqlite.h"
#include "datasets/statistics_store.h"
#include "support/example_campaign.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;
using Access = CampaignFile::Access;

/// Notes down what it is given.
class Notes : public FrameSink {
 public:
  void frames(std::span<const std::byte> data) override {
    bytes.insert(bytes.end(), data.begin(), data.end());
  }
  void gap(const Gap& gap) override { gaps.emplace_back(bytes.size() / 8, gap); }

  std::vector<std::byte> bytes;
  std::vector<std::pair<std::size_t, Gap>> gaps;  // with the number of frames before it
};

struct RawStore : testing::Test {
  test::TemporaryFolder folder;
  CampaignFile file{folder / "c.db", Access::kRecord};
  std::vector<std::byte> data = test::example_frames(1000, 3);

  std::span<const std::byte> frames(std::size_t first, std::size_t count) const {
    return std::span(data).subspan(first * 8, count * 8);
  }
};

TEST_F(RawStore, GivesBackFramesAndGapsInOrder) {
  RawWriter writer(file, "R1", {}, 133);
  const Gap middle{.first_frame = 250, .frames_lost = 17, .cause = "lost"};
  const Gap reboot{.first_frame = 250, .frames_lost = 99, .cause = "reboot", .estimated = true};
  const Gap end{.first_frame = 1000, .frames_lost = 5, .cause = "lost"};
  writer.frames(frames(0, 250));
  writer.gap(middle);
  writer.gap(reboot);
  writer.frames(frames(250, 300));
  writer.commit(Ledger{.frames_emitted = 666, .frames_stored = 550, .frames_lost = 116});
  writer.frames(frames(550, 450));
  writer.gap(end);
  const std::string hash = writer.finish(RunState::kComplete, Ledger{.frames_emitted = 1121,
                                                                     .frames_stored = 1000,
                                                                     .frames_lost = 121,
                                                                     .board_rate_hz = 1333.3357,
                                                                     .rate_interval_hz = 0.0004,
                                                                     .drift_ppm_h = 0.31,
                                                                     .drift_interval_ppm_h = 2.1,
                                                                     .end_reason = "complete",
                                                                     .source = "usb"});

  const RawRun run = raw_run(file, "R1").value();
  EXPECT_EQ(run.frames, 1000u);
  EXPECT_EQ(run.state, RunState::kComplete);
  EXPECT_EQ(run.hash, hash);
  Notes notes;
  read_raw(file, run, notes);
  EXPECT_EQ(notes.bytes, data);
  ASSERT_EQ(notes.gaps.size(), 3u);
  EXPECT_EQ(notes.gaps[0], std::make_pair(std::size_t{250}, middle));
  EXPECT_EQ(notes.gaps[1], std::make_pair(std::size_t{250}, reboot));
  EXPECT_EQ(notes.gaps[2], std::make_pair(std::size_t{1000}, end));
  const Ledger ledger = ledger_of(file, run.id).value();
  EXPECT_TRUE(ledger.closed());
  EXPECT_EQ(ledger.board_rate_hz, 1333.3357);
  EXPECT_EQ(ledger.rate_interval_hz, 0.0004);
  EXPECT_EQ(ledger.drift_ppm_h, 0.31);
  EXPECT_EQ(ledger.drift_interval_ppm_h, 2.1);
  EXPECT_EQ(ledger.end_reason, "complete");
  EXPECT_EQ(ledger.source, "usb");
}

TEST_F(RawStore, BlobsHoldATenthOfASecondAtMost) {
  RawWriter writer(file, "R1", {}, 133);
  writer.frames(frames(0, 1000));
  writer.finish(RunState::kComplete, {});
  EXPECT_LE(file.database().scalar_integer("SELECT max(length(data)) FROM raw_chunks"), 133 * 8);
}

TEST_F(RawStore, HashDoesNotDependOnHowFramesWereCut) {
  RawWriter one(file, "R1", {}, 133), other(file, "R2", {}, 50);
  one.frames(frames(0, 1000));
  for (std::size_t i = 0; i < 1000; i += 125) {
    other.frames(frames(i, 125));
    other.commit({});
  }
  EXPECT_EQ(one.finish(RunState::kComplete, {}), other.finish(RunState::kComplete, {}));
}

TEST_F(RawStore, DamageIsFoundAndNamed) {
  RawWriter writer(file, "R1", {}, 100);
  writer.frames(frames(0, 1000));
  writer.finish(RunState::kComplete, {});
  const RawRun run = raw_run(file, "R1").value();
  Notes notes;
  file.database().execute("UPDATE raw_chunks SET data = zeroblob(800) WHERE (id & 4294967295) = 300");
  try {
    read_raw(file, run, notes);
    FAIL() << "a damaged blob was read";
  } catch (const StorageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("run R1: the raw data at frame 300 are damaged"));
  }
  file.database().execute("DELETE FROM raw_chunks WHERE (id & 4294967295) >= 300");
  EXPECT_THROW(read_raw(file, run, notes), StorageError) << "missing blobs at the end";
}

TEST_F(RawStore, InterruptedRunsBecomePartial) {
  {
    RawWriter writer(file, "R1", {}, 100);
    writer.frames(frames(0, 500));
    writer.commit(Ledger{.frames_emitted = 500, .frames_stored = 500});
    writer.frames(frames(500, 100));  // never committed, as when the process is killed
  }
  EXPECT_THAT(close_interrupted_runs(file), testing::ElementsAre("R1"));
  const RawRun run = raw_run(file, "R1").value();
  EXPECT_EQ(run.state, RunState::kPartial);
  EXPECT_EQ(run.frames, 500u);
  EXPECT_THAT(run.hash, HasSubstr("xxh3:"));
  EXPECT_EQ(ledger_of(file, run.id)->end_reason, "the recorder ended before the run did");
  EXPECT_TRUE(close_interrupted_runs(file).empty());
}

/// The file can be recorded to all the same.
TEST_F(RawStore, AnInterruptedRunThatIsDamagedBecomesPartialAndStaysDamaged) {
  {
    RawWriter writer(file, "R1", {}, 100);
    writer.frames(frames(0, 500));
    writer.commit(Ledger{.frames_emitted = 500, .frames_stored = 500});
  }
  file.database().execute("UPDATE raw_chunks SET data = zeroblob(800) WHERE (id & 4294967295) = 300");
  EXPECT_THAT(close_interrupted_runs(file), testing::ElementsAre("R1"));
  const RawRun run = raw_run(file, "R1").value();
  EXPECT_EQ(run.state, RunState::kPartial);
  Notes notes;
  EXPECT_THROW(read_raw(file, run, notes), StorageError);
}

TEST_F(RawStore, FlagsAndBoardAreKeptAndAFileFromBeforeThemIsStillRead) {
  RawWriter writer(file, "R1", {}, 133);
  writer.frames(frames(0, 100));
  writer.finish(RunState::kComplete, Ledger{.frames_emitted = 100,
                                            .frames_stored = 100,
                                            .frames_clipped = 40,
                                            .frames_test_pattern = 50,
                                            .source = "tcp:x",
                                            .board_serial = "5A5B",
                                            .conversions_per_frame = 8});
  const std::int64_t id = raw_run(file, "R1")->id;
  EXPECT_EQ(ledger_of(file, id)->frames_clipped, 40u);
  EXPECT_EQ(ledger_of(file, id)->frames_test_pattern, 50u);
  EXPECT_EQ(ledger_of(file, id)->board_serial, "5A5B");
  EXPECT_EQ(ledger_of(file, id)->conversions_per_frame, 8u);
  file.database().execute(
      "ALTER TABLE ledgers DROP COLUMN board_serial; ALTER TABLE ledgers DROP COLUMN conversions_per_frame;"
      "PRAGMA user_version = 2");
  EXPECT_EQ(ledger_of(file, id)->frames_clipped, 40u);
  EXPECT_EQ(ledger_of(file, id)->board_serial, "");
  file.database().execute(
      "ALTER TABLE ledgers DROP COLUMN frames_clipped; ALTER TABLE ledgers DROP COLUMN frames_test_pattern;"
      "PRAGMA user_version = 1");
  EXPECT_EQ(ledger_of(file, id)->frames_stored, 100u);
  EXPECT_EQ(ledger_of(file, id)->frames_clipped, 0u);
  EXPECT_EQ(ledger_of(file, id)->source, "tcp:x");
  CampaignFile(folder / "c.db", Access::kWrite);  // which migrates it
  EXPECT_EQ(ledger_of(file, id)->source, "tcp:x");
  EXPECT_EQ(ledger_of(file, id)->board_serial, "");
}

/// `doctor` reads a run that grows meanwhile.
TEST_F(RawStore, ASnapshotIsOfOneInstant) {
  RawWriter writer(file, "R1", {}, 133);
  writer.frames(frames(0, 300));
  writer.commit(Ledger{.frames_emitted = 300, .frames_stored = 300});
  const CampaignFile reader(folder / "c.db", Access::kRead);
  {
    const Snapshot snapshot(reader);
    const RawRun run = raw_run(reader, "R1").value();
    writer.frames(frames(300, 200));
    writer.commit(Ledger{.frames_emitted = 500, .frames_stored = 500});
    Notes notes;
    read_raw(reader, run, notes);
    EXPECT_EQ(notes.bytes.size(), 300u * 8);
    EXPECT_EQ(ledger_of(reader, run.id)->frames_stored, 300u);
  }
  EXPECT_EQ(raw_run(reader, "R1")->frames, 500u);
}

TEST(RawKey, AFrameThatHasNoRoomIsRefused) {
  EXPECT_LT(chunk_key(1, kLastFrame), chunk_key(2, 0));
  EXPECT_THROW(chunk_key(1, kLastFrame + 1), StorageError) << "it would be run 2's first";
}

TEST_F(RawStore, RunsAreNamedOnce) {
  RawWriter writer(file, "R1", {}, 100);
  EXPECT_THAT(message_of([&] { RawWriter(file, "R1", {}, 100); }), HasSubstr("run R1 is in"));
}

TEST_F(RawStore, StatisticsComeBackAsStored) {
  const RawWriter writer(file, "R1", {}, 100);
  RunStatistics statistics{.hash = "xxh3:0", .frames = 9, .window_s = 0.25, .window_means_V = {1, 2, 3, 4}};
  statistics.channels.push_back({.mean_V = 1.5,
                                 .std_V = 0.1,
                                 .standard_error_V = 0.01,
                                 .drift_V = 0.2,
                                 .drift_z = 3,
                                 .lowest_V = 0,
                                 .highest_V = 3,
                                 .clipped = 4,
                                 .shaft_hz = 83.3,
                                 .lines = {{83.3, 0.2, 900, "shaft"}}});
  statistics.channels.push_back({.mean_V = 1});
  store_statistics(file, writer.id(), statistics);
  auto all = all_statistics(file);
  read_windows(file, all);
  const RunStatistics& read = all.at(writer.id());
  EXPECT_EQ(read.hash, "xxh3:0");
  EXPECT_EQ(read.frames, 9u);
  EXPECT_EQ(read.window_means_V, statistics.window_means_V);
  ASSERT_EQ(read.channels.size(), 2u);
  EXPECT_EQ(read.channels[0].mean_V, 1.5);
  EXPECT_EQ(read.channels[0].drift_z, 3);
  EXPECT_EQ(read.channels[0].clipped, 4u);
  EXPECT_EQ(read.channels[0].shaft_hz, 83.3);
  ASSERT_EQ(read.channels[0].lines.size(), 1u);
  EXPECT_EQ(read.channels[0].lines[0].name, "shaft");
  EXPECT_FALSE(read.channels[1].shaft_hz.has_value());
}

/// A blob of whole numbers of volts or none at all; anything else is damage, not something to be read past.
TEST_F(RawStore, WindowsOfADamagedFileAreRefused) {
  const RawWriter writer(file, "R1", {}, 100);
  store_statistics(file, writer.id(), {.hash = "xxh3:0", .channels = {{.mean_V = 1}}, .window_s = 0.25});
  auto all = all_statistics(file);
  read_windows(file, all);
  EXPECT_TRUE(all.at(writer.id()).window_means_V.empty());
  file.database().execute("UPDATE run_windows SET means_V = zeroblob(21)");
  try {
    read_windows(file, all);
    FAIL() << "21 bytes were read as numbers of 8";
  } catch (const StorageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("run R1: the means of its windows are damaged"));
  }
}

}  // namespace
}  // namespace tunnelrig
