// What the page says of a run under way is what the reduction says of it afterwards.
#include "cli/live/means.h"

#include "analysis/run_summary.h"
#include "cli/live/book.h"
#include "cli/live/run_alarms.h"
#include "support/seeds.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace tunnelrig::live {
namespace {

/// Frames of a run whose channels share half of their turbulence; 0.08 s correlated, as the virtual rig's.
std::vector<std::array<std::int16_t, 4>> frames_of(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  const double decay = std::exp(-1 / (0.08 * 4000 / 3)), kick = std::sqrt(1 - decay * decay);
  std::array<double, 5> gust{};
  std::vector<std::array<std::int16_t, 4>> frames(count);
  for (auto& frame : frames) {
    for (double& g : gust) g = decay * g + kick * normal(engine);
    for (std::size_t c = 0; c < 4; ++c)
      frame[c] = static_cast<std::int16_t>(
          std::lround(2500 + 20.0 * static_cast<double>(c) + 15 * gust[c] + 15 * gust[4]));
  }
  return frames;
}

struct KnownRig {
  CampaignInfo info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
  Scale scale{.newtons = true, .slope = {0.0033, 0.0033, 0.0033, 0.0033}, .offset = {-1, -1, -1, -1}};

  RunningMeans means(const std::vector<std::array<std::int16_t, 4>>& frames) const {
    RunningBlocks blocks(67);
    for (std::size_t i = 0; i < frames.size(); ++i) blocks.add({i, 1, frames[i]});
    return running_means(blocks, scale, info, 20);
  }
};

TEST(RunningMeans, AgreeWithTheRunSummary) {
  const KnownRig rig;
  const auto frames = frames_of(80000, test::seed());
  const auto summarizer = make_run_summarizer(rig.info, RawFormat{}, false);
  summarizer->frames(std::as_bytes(std::span(frames)));
  const RunStatistics statistics = summarizer->finish("");
  const RunningMeans means = rig.means(frames);
  const double volts = rig.info.daq.volts_per_count();
  ASSERT_EQ(means.rotors.size(), 4u);
  for (std::size_t c = 0; c < 4; ++c) {
    const ChannelStatistics& channel = statistics.channels[c];
    EXPECT_NEAR(means.rotors[c].mean, rig.scale.value(c, channel.mean_V / volts), 1e-9);
    ASSERT_TRUE(means.rotors[c].u95);
    const double standard_error_N = channel.standard_error_V / volts * rig.scale.slope[c];
    EXPECT_NEAR(*means.rotors[c].u95 / standard_error_N, 1.97, 0.04)
        << "Student's t of many degrees of freedom";
  }
}

/// Rotors that move together leave C_T less well known than independent ones would, and U better.
TEST(RunningMeans, U95CoversWhereRotorsMoveTogether) {
  const KnownRig rig;
  int c_t_covered = 0, u_covered = 0;
  constexpr int kRuns = 60;
  const double truth_c_t = rig.means(frames_of(2000000, 7)).c_t->mean;
  const double truth_u = rig.means(frames_of(2000000, 7)).u_percent->mean;
  for (int i = 0; i < kRuns; ++i) {
    const RunningMeans means = rig.means(frames_of(13333, test::seed() + static_cast<std::uint64_t>(i)));
    c_t_covered += std::abs(means.c_t->mean - truth_c_t) < *means.c_t->u95 ? 1 : 0;
    u_covered += std::abs(means.u_percent->mean - truth_u) < *means.u_percent->u95 ? 1 : 0;
  }
  // 95 % of 60 is 57; below 50 is seven in ten thousand, and a C_T without the common part would be near 40
  EXPECT_GE(c_t_covered, 50);
  EXPECT_GE(u_covered, 50);
}

TEST(RunningMeans, SayNothingTooEarly) {
  const KnownRig rig;
  const RunningMeans means = rig.means(frames_of(300, test::seed()));
  EXPECT_FALSE(means.rotors[0].u95);
  EXPECT_FALSE(means.c_t->u95);
  KnownRig cold = rig;
  cold.scale.newtons = false;
  EXPECT_FALSE(cold.means(frames_of(3000, 1)).c_t);
}

/// A plug that is out at the last tare is not the zero of what follows.
TEST(Cells, ATareThatIsStuckIsNoZero) {
  CampaignData data;
  data.info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
  for (const char* name : {"T1", "T2"}) {
    tunnelrig::Run& run = data.runs.emplace_back();
    run.run = name;
    run.session = "S1";
    run.kind = RunKind::kTare;
    data.raw[name] = {.run = name, .state = RunState::kComplete};
    data.statistics[name].channels.resize(4, {.mean_V = 0.4, .lowest_V = 0.3, .highest_V = 0.5});
  }
  data.statistics["T2"].channels[1] = {};
  const CellKnowledge::Tare tare = cells_of(data).tares.at("S1");
  EXPECT_EQ(tare.mean_V[1], 0.4);
  EXPECT_EQ(tare.drift_rotor, 0);
}

TEST(RunAlarms, AreFoundInAllOfTheRunsFrames) {
  const KnownRig rig;
  const double volts = rig.info.daq.volts_per_count();
  LogOutcome outcome;
  outcome.statistics.channels.resize(
      4, {.std_V = 5 * volts, .lowest_V = 2400 * volts, .highest_V = 2600 * volts});
  EXPECT_EQ(alarms_of(outcome, rig.scale, rig.info, ""), "");
  EXPECT_EQ(alarms_of(outcome, rig.scale, rig.info, "speed;tare_drift"), "speed;tare_drift");
  LogOutcome flagged = outcome;
  flagged.ledger.frames_clipped = flagged.ledger.frames_test_pattern = 1;
  EXPECT_EQ(alarms_of(flagged, rig.scale, rig.info, ""), "clipping;test_pattern");
  outcome.statistics.channels[0].clipped = 1;
  outcome.statistics.channels[1].lowest_V = outcome.statistics.channels[1].highest_V;
  outcome.statistics.channels[2].std_V = 0.1 * volts;
  outcome.statistics.channels[3].highest_V = 3400 * volts;
  outcome.ledger.frames_lost = 1;
  outcome.ledger.silences = 1;
  EXPECT_EQ(alarms_of(outcome, rig.scale, rig.info, "loss"), "clipping;dead;loss;overload;silent;stuck");
}

}  // namespace
}  // namespace tunnelrig::live
