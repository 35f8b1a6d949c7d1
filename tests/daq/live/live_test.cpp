// What a screen shows of a recording: no peak hides, a gap is a gap, memory is bounded, and nobody waits.
#include "daq/live/channel_watch.h"
#include "daq/live/display_bins.h"
#include "daq/live/frame_ring.h"
#include "daq/live/frame_window.h"
#include "daq/live/running_blocks.h"
#include "daq/logging.h"
#include "daq/virtual_board.h"
#include "support/seeds.h"

#include <random>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using Counts = std::array<std::int16_t, 4>;

LiveFrame frame(std::uint64_t index, std::int16_t value) { return {index, 1, {value, value, value, value}}; }

void push(FrameRing& ring, const std::vector<Counts>& frames) {
  ring.frames(std::as_bytes(std::span(frames)));
}

TEST(FrameRing, KeepsOrderAndShowsGaps) {
  FrameRing ring(16);
  ring.begin_run();
  push(ring, {{1, 2, 3, 4}, {5, 6, 7, 8}});
  ring.gap({.first_frame = 2, .frames_lost = 7});
  push(ring, {{9, 9, 9, 9}});
  std::vector<LiveFrame> taken;
  ring.take(taken);
  ASSERT_EQ(taken.size(), 3u);
  EXPECT_EQ(taken[0].counts, (Counts{1, 2, 3, 4}));
  EXPECT_EQ(taken[1].index, 1u);
  EXPECT_EQ(taken[2].index, 9u);
  ring.begin_run();
  push(ring, {{1, 1, 1, 1}});
  ring.take(taken);
  EXPECT_EQ(taken.back().index, 0u);
  EXPECT_EQ(taken.back().run, ring.run());
  EXPECT_EQ(ring.dropped(), 0u);
}

TEST(FrameRing, DropsWhatNobodyTakes) {
  FrameRing ring(64);
  ring.begin_run();
  push(ring, std::vector<Counts>(100, Counts{}));
  std::vector<LiveFrame> taken;
  ring.take(taken);
  EXPECT_EQ(taken.size(), 64u);
  EXPECT_EQ(ring.dropped(), 36u);
  push(ring, {Counts{}});
  taken.clear();
  ring.take(taken);
  ASSERT_EQ(taken.size(), 1u);
  EXPECT_EQ(taken[0].index, 100u) << "what was dropped leaves a gap";
}

TEST(FrameRing, HandsOverBetweenThreads) {
  constexpr std::uint64_t kFrames = 400000;
  FrameRing ring(1024);
  ring.begin_run();
  std::atomic<bool> done{false};
  std::thread writer([&] {
    std::vector<Counts> packet(16);
    for (std::uint64_t first = 0; first < kFrames; first += packet.size()) {
      for (std::size_t i = 0; i < packet.size(); ++i)
        packet[i].fill(static_cast<std::int16_t>((first + i) % 30000));
      push(ring, packet);
    }
    done = true;
  });
  std::vector<LiveFrame> taken;
  std::uint64_t count = 0, next = 0;
  for (bool last = false; !last;) {
    last = done;
    taken.clear();
    ring.take(taken);
    for (const LiveFrame& got : taken) {
      ASSERT_GE(got.index, next);
      next = got.index + 1;
      ASSERT_EQ(got.counts[3], static_cast<std::int16_t>(got.index % 30000));
    }
    count += taken.size();
  }
  writer.join();
  EXPECT_EQ(count + ring.dropped(), kFrames);
}

TEST(FrameRing, NeverHoldsUpTheRecorder) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const auto record = [&](const std::string& name, FrameSink* watcher) {
    auto next = std::make_shared<std::int16_t>(0);
    VirtualBoard board({}, [next] {
      trw_frame sample{};
      for (auto& value : sample.sample) value = static_cast<std::int16_t>(++*next & 0xFFF);
      return sample;
    });
    return log_run(board, file, test::cells(name), {.duration_s = 30, .watcher = watcher}, test::summarizer(),
                   {}, test::never_stop());
  };
  FrameRing nobody_takes(256);
  nobody_takes.begin_run();
  const LogOutcome watched = record("R1", &nobody_takes);
  const LogOutcome unwatched = record("R2", nullptr);
  EXPECT_EQ(watched.statistics.hash, unwatched.statistics.hash);
  EXPECT_EQ(watched.ledger.frames_stored, 40000u);
  EXPECT_EQ(nobody_takes.dropped(), 40000u - 256u);
}

class Bins : public testing::TestWithParam<double> {};

TEST_P(Bins, NoPeakHides) {
  const double per_bin = GetParam();
  std::mt19937 engine(test::seed());
  std::uniform_int_distribution<int> noise(1000, 1100);
  DisplayBins bins(per_bin);
  std::map<std::uint64_t, std::pair<int, int>> expected;  // by bin: lowest and highest
  std::uint64_t index = 0;
  std::map<std::uint64_t, std::pair<int, int>> seen;
  const auto collect = [&](bool all) {
    const BinRange range = bins.take(all);
    for (std::size_t i = 0; i < range.bins.size(); ++i) {
      if (range.bins[i].empty) continue;
      ASSERT_FALSE(seen.contains(range.first + i)) << "a bin was handed out twice";
      seen[range.first + i] = {range.bins[i].low[2], range.bins[i].high[2]};
    }
  };
  for (int n = 0; n < 20000; ++n, ++index) {
    if (n % 997 == 0) index += 40;  // lost
    int value = noise(engine);
    if (n % 1571 == 0) value = n % 2 == 0 ? 4095 : 0;  // a peak of one frame
    bins.add(frame(index, static_cast<std::int16_t>(value)));
    const auto bin = static_cast<std::uint64_t>(static_cast<double>(index) / per_bin);
    const auto [found, fresh] = expected.emplace(bin, std::pair(value, value));
    found->second.first = std::min(found->second.first, value);
    found->second.second = std::max(found->second.second, value);
    if (n % 53 == 0) collect(false);
  }
  collect(true);
  EXPECT_EQ(seen, expected);
}

INSTANTIATE_TEST_SUITE_P(FramesPerBin, Bins, testing::Values(1.0, 13.0 + 1.0 / 3, 40.0, 2.5));

TEST(DisplayBins, AGapIsAGap) {
  DisplayBins bins(10);
  for (std::uint64_t i = 0; i < 25; ++i) bins.add(frame(i, 7));
  for (std::uint64_t i = 60; i < 81; ++i) bins.add(frame(i, 9));
  const BinRange range = bins.take();
  EXPECT_EQ(range.first, 0u);
  ASSERT_EQ(range.bins.size(), 8u) << "bins 0 to 7; 8 is open";
  for (const std::size_t lost : {3u, 4u, 5u}) EXPECT_TRUE(range.bins[lost].empty);
  for (const std::size_t kept : {0u, 1u, 2u, 6u, 7u}) EXPECT_FALSE(range.bins[kept].empty);
  EXPECT_TRUE(bins.take().bins.empty());
}

TEST(DisplayBins, StaysBoundedWhateverIsLost) {
  DisplayBins bins(10);
  bins.add(frame(0, 1));
  bins.add(frame(std::uint64_t{1} << 40, 2));  // a reboot that took years
  bins.add(frame((std::uint64_t{1} << 40) + 10, 3));
  const BinRange range = bins.take();
  EXPECT_EQ(range.bins.size(), 1u);
  EXPECT_EQ(range.bins[0].high[0], 2);
  for (std::uint64_t i = 0; i < 100000; ++i) bins.add(frame((std::uint64_t{1} << 41) + 20 * i, 4));
  EXPECT_LE(bins.take().bins.size(), DisplayBins::kMostBins);
}

TEST(RunningBlocks, MeanIsThatOfAllFramesInBoundedMemory) {
  RunningBlocks blocks(5);
  double sum = 0;
  constexpr int kFrames = 50000;
  for (int i = 0; i < kFrames; ++i) {
    const auto value = static_cast<std::int16_t>(1000 + i % 700);
    sum += value;
    blocks.add(frame(static_cast<std::uint64_t>(i), value));
  }
  EXPECT_NEAR(blocks.mean()[1], sum / kFrames, 1e-9);
  EXPECT_LT(blocks.blocks().size(), RunningBlocks::kMostBlocks);
  EXPECT_GE(blocks.blocks().size(), RunningBlocks::kMostBlocks / 2 - 1);
  double mean = 0;
  for (const auto& block : blocks.blocks()) mean += block[1] / static_cast<double>(blocks.blocks().size());
  EXPECT_NEAR(mean, sum / kFrames, 2.0) << "the last, open block is not among them";
}

TEST(RunningBlocks, ABlockThatAGapCutShortDoesNotCount) {
  RunningBlocks blocks(10);
  for (std::uint64_t i = 0; i < 13; ++i) blocks.add(frame(i, 5));
  for (std::uint64_t i = 30; i < 41; ++i) blocks.add(frame(i, 5));
  EXPECT_EQ(blocks.blocks().size(), 2u) << "0 to 9, 30 to 39; not 10 to 12";
  EXPECT_DOUBLE_EQ(blocks.mean()[0], 5);
}

TEST(ChannelWatch, SeesWhatIsWrong) {
  ChannelWatch watch(1000, 4095);
  std::mt19937 engine(test::seed());
  std::normal_distribution<double> noise(2000, 5);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto value = static_cast<std::int16_t>(noise(engine));
    EXPECT_FALSE(watch.ready());
    watch.add({i,
               1,
               {value, 1234, static_cast<std::int16_t>(i == 500 ? 1235 : 1234),
                static_cast<std::int16_t>(i % 100 == 0 ? 4095 : value)}});
  }
  ASSERT_TRUE(watch.ready());
  const auto& channels = watch.channels();
  EXPECT_FALSE(channels[0].stuck() || channels[0].dead() || channels[0].clipped > 0);
  EXPECT_NEAR(channels[0].std, 5, 0.5);
  EXPECT_TRUE(channels[1].stuck());
  EXPECT_TRUE(channels[2].dead());
  EXPECT_EQ(channels[3].clipped, 10u);
}

TEST(FrameWindow, BridgesAShortGapAndBeginsAnewBehindALongOne) {
  FrameWindow window(4);
  for (std::uint64_t i = 0; i < 6; ++i) window.add(frame(i, 1));
  EXPECT_TRUE(window.full());
  EXPECT_EQ(window.frames().front().index, 2u);
  window.add(frame(8, 2));  // 6 and 7 are missing
  EXPECT_EQ(window.frames()[2].index, 7u);
  EXPECT_EQ(window.frames()[2].counts[0], 1);
  EXPECT_EQ(window.frames()[3].counts[0], 2);
  window.add(frame(10 + FrameWindow::kBridged, 1));
  EXPECT_FALSE(window.full());
  EXPECT_EQ(window.frames().size(), 1u);
}

}  // namespace
}  // namespace tunnelrig
