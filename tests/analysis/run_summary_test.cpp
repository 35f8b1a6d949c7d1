#include "analysis/run_summary.h"

#include "analysis/autocorrelation.h"
#include "calibration/distributions.h"
#include "support/example_campaign.h"
#include "support/seeds.h"

#include <cmath>
#include <cstring>
#include <functional>
#include <future>
#include <map>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

const CampaignInfo kCampaign = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
const double kRate_hz = kCampaign.daq.sample_rate_hz;

/// Samples of four channels as doubles of volts.
std::vector<std::byte> volts(std::size_t frames,
                             const std::function<double(std::size_t frame, std::size_t channel)>& signal) {
  std::vector<double> samples;
  samples.reserve(frames * 4);
  for (std::size_t i = 0; i < frames; ++i) {
    for (std::size_t c = 0; c < 4; ++c) samples.push_back(signal(i, c));
  }
  std::vector<std::byte> bytes(samples.size() * sizeof(double));
  std::memcpy(bytes.data(), samples.data(), bytes.size());
  return bytes;
}

double wave(double frequency_hz, std::size_t frame) {
  return std::sin(2 * std::numbers::pi * frequency_hz * static_cast<double>(frame) / kRate_hz);
}

RunStatistics summarize(const std::vector<std::byte>& data, const RawFormat& format, std::size_t piece = 0,
                        std::optional<double> measured_rpm = {}) {
  const auto summarizer = make_run_summarizer(at_speed(kCampaign, measured_rpm), format);
  const std::size_t step = piece == 0 ? data.size() : piece * format.frame_size();
  for (std::size_t at = 0; at < data.size(); at += step) {
    summarizer->frames(std::span(data).subspan(at, std::min(step, data.size() - at)));
  }
  return summarizer->finish("hash");
}

TEST(RunSummary, ExactSumsWhateverThePieces) {
  for (const SampleType type :
       {SampleType::kInt16, SampleType::kUInt16, SampleType::kFloat32, SampleType::kFloat64}) {
    const RawFormat format{type, 4};
    const auto data = test::example_frames(5000, 3, format);
    const RunStatistics whole = summarize(data, format);
    const double scale = is_counts(type) ? kCampaign.daq.volts_per_count() : 1;
    for (std::size_t c = 0; c < 4; ++c) {
      double sum = 0, square = 0;
      for (std::size_t i = 0; i < 5000; ++i) {
        double value = 0;
        const std::byte* at = data.data() + (i * 4 + c) * sample_size(type);
        if (type == SampleType::kInt16 || type == SampleType::kUInt16) {
          std::uint16_t counts = 0;
          std::memcpy(&counts, at, 2);
          value = counts;
        } else if (type == SampleType::kFloat32) {
          float single = 0;
          std::memcpy(&single, at, 4);
          value = static_cast<double>(single);
        } else {
          std::memcpy(&value, at, 8);
        }
        sum += value * scale;
        square += value * scale * value * scale;
      }
      const double mean = sum / 5000;
      EXPECT_NEAR(whole.channels[c].mean_V, mean, 1e-12);
      EXPECT_NEAR(whole.channels[c].std_V, std::sqrt(square / 5000 - mean * mean), 1e-9);
    }
    for (const std::size_t piece : {1u, 66u, 133u, 4096u}) {
      const RunStatistics cut = summarize(data, format, piece);
      for (std::size_t c = 0; c < 4; ++c) {
        EXPECT_EQ(cut.channels[c].mean_V, whole.channels[c].mean_V);
        EXPECT_EQ(cut.channels[c].standard_error_V, whole.channels[c].standard_error_V);
      }
      EXPECT_EQ(cut.window_means_V, whole.window_means_V);
    }
  }
}

TEST(RunSummary, ExtremesAndClipping) {
  std::vector<std::byte> data = test::example_frames(1000, 1);
  const std::int16_t top = 4095, bottom = 0;
  std::memcpy(data.data() + 500 * 8, &top, 2);
  std::memcpy(data.data() + 501 * 8, &bottom, 2);
  const RunStatistics statistics = summarize(data, {});
  EXPECT_EQ(statistics.channels[0].clipped, 2u);
  EXPECT_EQ(statistics.channels[1].clipped, 0u);
  EXPECT_EQ(statistics.channels[0].lowest_V, 0);
  EXPECT_NEAR(statistics.channels[0].highest_V, 4095 * 3.3 / 4096, 1e-12);
  EXPECT_FALSE(statistics.channels[0].stuck());
  EXPECT_TRUE(
      summarize(volts(100, [](auto, auto) { return 1.5; }), {SampleType::kFloat64, 4}).channels[2].stuck());
}

/// Turbulence of 80 ms in 60 s: the standard error must be the scatter of the mean over many runs, not that
/// of independent samples.
TEST(RunSummary, StandardErrorRespectsAutocorrelation) {
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> unit;
  const std::size_t frames = 8000;
  const double decay = std::exp(-1 / (0.08 * kRate_hz));
  std::vector<double> means, errors;
  for (int run = 0; run < 150; ++run) {
    std::array<double, 4> state{};
    for (double& value : state) value = 0.1 * unit(engine);
    const RunStatistics statistics =
        summarize(volts(frames,
                        [&](std::size_t, std::size_t c) {
                          state[c] = decay * state[c] + 0.1 * std::sqrt(1 - decay * decay) * unit(engine);
                          return 2 + state[c];
                        }),
                  {SampleType::kFloat64, 4});
    for (const ChannelStatistics& channel : statistics.channels) {
      means.push_back(channel.mean_V);
      errors.push_back(channel.standard_error_V);
    }
  }
  double square = 0, claimed = 0;
  for (std::size_t i = 0; i < means.size(); ++i) {
    square += (means[i] - 2) * (means[i] - 2) / static_cast<double>(means.size());
    claimed += errors[i] * errors[i] / static_cast<double>(means.size());
  }
  EXPECT_NEAR(std::sqrt(claimed / square), 1, 0.12);
  EXPECT_GT(std::sqrt(claimed), 5 * 0.1 / std::sqrt(8000)) << "8000 samples are not 8000 independent ones";
}

TEST(RunSummary, IndependentValuesGiveTheTextbookError) {
  std::mt19937_64 engine(5);
  std::normal_distribution<double> unit;
  double ratio = 0;
  for (int i = 0; i < 200; ++i) {
    std::vector<double> series(200);
    for (double& value : series) value = unit(engine);
    ratio += variance_of_mean(series) * 200 / 200;
  }
  EXPECT_NEAR(ratio, 1, 0.15);
}

TEST(RunSummary, DriftIsSeenAndNoiseIsNot) {
  std::mt19937_64 engine(7);
  std::normal_distribution<double> unit;
  const RunStatistics statistics =
      summarize(volts(8000,
                      [&](std::size_t i, std::size_t c) {
                        return 2 + 0.01 * unit(engine) + (c == 1 ? 0.02 * static_cast<double>(i) / 8000 : 0);
                      }),
                {SampleType::kFloat64, 4});
  EXPECT_TRUE(statistics.channels[0].stationary());
  EXPECT_FALSE(statistics.channels[1].stationary());
  EXPECT_NEAR(statistics.channels[1].drift_V, 0.02, 0.002);
}

/// Eight blocks know their own scatter badly: one white run of a dozen was said to drift.
TEST(RunSummary, AShortRunOfNoiseDoesNotDrift) {
  constexpr int kRuns = 3000;
  std::mt19937_64 engine(8);
  std::normal_distribution<double> unit;
  for (const std::size_t blocks : {8U, 20U, 200U}) {
    int drifts = 0, beyond_95 = 0, seen = 0;
    for (int run = 0; run < kRuns; ++run) {
      std::vector<double> series(blocks);
      for (double& value : series) value = unit(engine);
      const double z = trend_of(series).z;
      drifts += std::abs(z) > 4.5 ? 1 : 0;
      beyond_95 += std::abs(z) > 1.96 ? 1 : 0;
      for (std::size_t i = 0; i < blocks; ++i) series[i] += 40.0 * static_cast<double>(i);
      seen += trend_of(series).z > 4.5 ? 1 : 0;
    }
    EXPECT_EQ(drifts, 0) << blocks;
    EXPECT_NEAR(beyond_95, 0.045 * kRuns, 0.015 * kRuns) << blocks;
    EXPECT_EQ(seen, kRuns) << blocks;
  }
}

/// Windows of 0.25 s of a run of 60 s, of noise that lasts so long.
std::vector<double> slow_noise(double lasts_s, std::mt19937_64& engine) {
  std::normal_distribution<double> unit;
  const double decay = std::exp(-0.25 / lasts_s);
  std::vector<double> series(240);
  double value = unit(engine);
  for (double& each : series) each = value = decay * value + std::sqrt(1 - decay * decay) * unit(engine);
  return series;
}

/// Of noise that lasts a sixth of the run the standard error alone, taken for well known, held 71 %.
TEST(RunSummary, AMeanInSlowNoiseIsKnownToFewDegreesOfFreedom) {
  constexpr int kRuns = 1500;
  std::mt19937_64 engine(12);
  for (const auto& [lasts_s, at_least] : {std::pair{0.2, 0.93}, {1.0, 0.93}, {3.0, 0.91}, {10.0, 0.85}}) {
    int held = 0, alone = 0, drifts = 0;
    for (int run = 0; run < kRuns; ++run) {
      const std::vector<double> series = slow_noise(lasts_s, engine);
      double mean = 0;
      for (const double value : series) mean += value / static_cast<double>(series.size());
      const MeanKnowledge known = knowledge_of_mean(series);
      held += std::abs(mean) <= half_width_95(std::sqrt(known.variance), known.dof) ? 1 : 0;
      alone += std::abs(mean) <= 1.96 * std::sqrt(variance_of_mean(series)) ? 1 : 0;
      drifts += std::abs(trend_of(series).z) > 4.5 ? 1 : 0;
    }
    std::printf(
        "noise of %4.1f s: held in %.3f, by the standard error alone in %.3f; flagged as a drift %.4f\n",
        lasts_s, held / double{kRuns}, alone / double{kRuns}, drifts / double{kRuns});
    EXPECT_GT(held, at_least * kRuns) << lasts_s;
    EXPECT_LT(held, 0.975 * kRuns) << lasts_s;
    EXPECT_LT(drifts, 0.01 * kRuns) << lasts_s;
  }
}

TEST(RunSummary, LinesAreFoundNamedAndMeasured) {
  std::mt19937_64 engine(9);
  std::normal_distribution<double> unit;
  const double shaft_hz = 83.71;
  const RunStatistics statistics = summarize(
      volts(80000,
            [&](std::size_t i, std::size_t) {
              return 2 + 0.02 * unit(engine) + 0.1 * wave(shaft_hz, i) + 0.04 * wave(2 * shaft_hz, i) +
                     0.01 * wave(50, i) + 0.02 * wave(9 * shaft_hz, i);
            }),
      {SampleType::kFloat64, 4});
  const ChannelStatistics& channel = statistics.channels[0];
  ASSERT_TRUE(channel.shaft_hz.has_value());
  EXPECT_NEAR(*channel.shaft_hz, shaft_hz, 0.01) << "a second tachometer, to 0.6 rev/min";
  std::map<std::string, SpectralLine> lines;
  for (const SpectralLine& line : channel.lines) lines[line.name] = line;
  EXPECT_NEAR(lines["shaft"].amplitude_V, 0.1, 0.003);
  EXPECT_NEAR(lines["blade_pass"].amplitude_V, 0.04, 0.002);
  EXPECT_NEAR(lines["mains_50"].amplitude_V, 0.01, 0.001);
  ASSERT_TRUE(lines.contains("shaft_x9_alias")) << "753 Hz folds to 580 Hz";
  EXPECT_NEAR(lines["shaft_x9_alias"].frequency_hz, kRate_hz - 9 * shaft_hz, 0.05);
}

TEST(RunSummary, ThreeBladesPassThreeTimesATurn) {
  std::mt19937_64 engine(11);
  std::normal_distribution<double> unit;
  constexpr double kShaft_hz = 83.71;
  CampaignInfo campaign = kCampaign;
  campaign.rig.blades = 3;
  const auto summarizer = make_run_summarizer(campaign, {SampleType::kFloat64, 4});
  summarizer->frames(volts(40000, [&](std::size_t i, std::size_t) {
    return 2 + 0.02 * unit(engine) + 0.1 * wave(kShaft_hz, i) + 0.02 * wave(2 * kShaft_hz, i) +
           0.04 * wave(3 * kShaft_hz, i);
  }));
  std::map<std::string, double> lines_V;
  const RunStatistics statistics = summarizer->finish("hash");
  for (const SpectralLine& line : statistics.channels[0].lines) lines_V[line.name] = line.amplitude_V;
  EXPECT_NEAR(lines_V["blade_pass"], 0.04, 0.002);
  EXPECT_NEAR(lines_V["shaft_x2"], 0.02, 0.002);
}

/// Of a run of a second: the thirteenth multiple of 201.3 Hz would appear at 50 Hz, but the mains are there.
TEST(RunSummary, AHumIsNoAliasOfAFastShaft) {
  std::mt19937_64 engine(10);
  std::normal_distribution<double> unit;
  constexpr double kShaft_hz = 201.28;
  const RunStatistics statistics =
      summarize(volts(1600,
                      [&](std::size_t i, std::size_t) {
                        return 2 + 0.01 * unit(engine) + 0.05 * wave(kShaft_hz, i) + 0.03 * wave(49.98, i);
                      }),
                {SampleType::kFloat64, 4}, 0, 60 * kShaft_hz);
  const ChannelStatistics& channel = statistics.channels[0];
  ASSERT_TRUE(channel.shaft_hz.has_value()) << "far from the nominal speed, but where it was measured";
  EXPECT_NEAR(*channel.shaft_hz, kShaft_hz, 0.2);
  ASSERT_GE(channel.lines.size(), 2u);
  EXPECT_EQ(channel.lines[0].name, "shaft");
  EXPECT_EQ(channel.lines[1].name, "mains_50");
}

/// At 3000 and 5000 rev/min multiples of the shaft lie on those of the grid; at 5230 they do not.
TEST(RunSummary, WhatAMultipleOfTheShaftMayBeIsNoHum) {
  std::mt19937_64 engine(13);
  std::normal_distribution<double> unit;
  const auto names = [&](double speed_rpm, const std::vector<double>& lines_hz,
                         std::optional<double> mains_hz, double shaft_V = 0.1) {
    CampaignInfo campaign = kCampaign;
    campaign.rig.nominal_speed_rpm = speed_rpm;
    campaign.daq.mains_hz = mains_hz;
    const auto summarizer = make_run_summarizer(campaign, {SampleType::kFloat64, 4});
    summarizer->frames(volts(8000, [&](std::size_t i, std::size_t) {
      double sum = 2 + 0.02 * unit(engine) + shaft_V * wave(speed_rpm / 60, i);
      for (const double hz : lines_hz) sum += 0.04 * wave(hz, i);
      return sum;
    }));
    std::map<double, std::string> found;
    const RunStatistics statistics = summarizer->finish("hash");  // the loop refers to it
    for (const SpectralLine& line : statistics.channels[0].lines)
      found[std::round(line.frequency_hz)] = line.name;
    return found;
  };
  EXPECT_EQ(names(3000.5, {100, 150}, {})[100], "blade_pass");
  EXPECT_EQ(names(3000.5, {100, 150}, {})[150], "shaft_x3");
  EXPECT_EQ(names(5002, {250.05}, {})[250], "shaft_x3");
  EXPECT_EQ(names(5230, {100, 250}, {})[250], "mains_250");
  EXPECT_EQ(names(5230, {60}, {})[60], "mains_60");
  EXPECT_EQ(names(5230, {60}, 50)[60], "") << "of another grid than the campaign's";
  EXPECT_EQ(names(3700, {60.1}, 60, 0.03)[62], "shaft") << "beside a stronger hum";
  EXPECT_EQ(names(3700, {60.1}, 60, 0.03)[60], "mains_60");
  EXPECT_EQ(names(5230, {2 * 5230.0 / 60}, {}, 0)[174], "blade_pass") << "of a propeller without imbalance";
}

TEST(RunSummary, NoiseHasNoLines) {
  std::mt19937_64 engine(11);
  std::normal_distribution<double> unit;
  int lines = 0;
  for (int run = 0; run < 10; ++run) {
    const RunStatistics statistics = summarize(
        volts(20000, [&](std::size_t, std::size_t) { return unit(engine); }), {SampleType::kFloat64, 4});
    for (const ChannelStatistics& channel : statistics.channels)
      lines += static_cast<int>(channel.lines.size());
  }
  EXPECT_LE(lines, 2) << "of 80,000 bins";
}

TEST(RunSummary, ShortRunsAndOneChannel) {
  const RawFormat one{SampleType::kInt16, 1};
  std::vector<std::byte> data(2 * 300);
  for (std::size_t i = 0; i < 300; ++i) data[2 * i] = static_cast<std::byte>(i % 7);
  EXPECT_EQ(summarize(data, one).channels.size(), 1u);
  EXPECT_EQ(summarize({}, {}).frames, 0u);
  EXPECT_EQ(summarize(test::example_frames(3, 1), {}).frames, 3u);
}

TEST(RunSummary, ThreadsThatComeAndGoAgree) {
  const auto data = test::example_frames(9000, 1);
  const RunStatistics alone = summarize(data, {});
  for (int round = 0; round < 60; ++round) {
    std::vector<std::future<RunStatistics>>
        others;  // each makes its transforms' plans, and destroys them at its end
    for (int i = 0; i < 4; ++i)
      others.push_back(std::async(std::launch::async, [&] { return summarize(data, {}); }));
    for (auto& other : others) {
      const RunStatistics statistics = other.get();
      EXPECT_EQ(statistics.channels[2].mean_V, alone.channels[2].mean_V);
      ASSERT_EQ(statistics.channels[2].lines.size(), alone.channels[2].lines.size());
    }
  }
}

TEST(RunSummary, GapsMoveTimeOn) {
  const auto data = test::example_frames(670, 1);  // two windows of 335 frames
  const auto summarizer = make_run_summarizer(kCampaign, {});
  summarizer->frames(std::span(data).first(335 * 8));
  summarizer->gap({.first_frame = 335, .frames_lost = 670});
  summarizer->frames(std::span(data).subspan(335 * 8));
  const RunStatistics statistics = summarizer->finish("");
  ASSERT_EQ(statistics.window_means_V.size(), 4u * 4);
  EXPECT_FALSE(std::isnan(statistics.window_means_V[0]));
  EXPECT_TRUE(std::isnan(statistics.window_means_V[4])) << "everything in this window was lost";
  EXPECT_TRUE(std::isnan(statistics.window_means_V[8]));
  EXPECT_FALSE(std::isnan(statistics.window_means_V[12]));
  EXPECT_EQ(statistics.frames, 670u);
}

}  // namespace
}  // namespace tunnelrig
