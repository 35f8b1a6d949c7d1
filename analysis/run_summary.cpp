#include "analysis/run_summary.h"

#include "analysis/autocorrelation.h"
#include "analysis/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

// One binary serves every x86-64; the loops that a campaign spends its time in choose their instructions at
// run time.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define TUNNELRIG_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define TUNNELRIG_CLONES
#endif

namespace tunnelrig {
namespace {

constexpr double kBlock_s = 0.05;
constexpr std::size_t kBlocksPerWindow = 5;
constexpr std::size_t kLanes = 16;  // samples taken side by side: four frames of four channels
constexpr std::size_t kMostWindows = 1000000;

/// Sums over one block, per channel, in the units of the samples.
struct BlockSums {
  std::array<double, 4> sum{}, square{}, lowest{}, highest{};
};

template <typename Sample>
using Wide = std::conditional_t<std::is_integral_v<Sample>, std::int64_t, double>;

/// Folds lanes into channels; a lane holds the samples whose index has its remainder.
template <typename Sample>
TUNNELRIG_CLONES void sum_lanes(const Sample* data, std::size_t count, Wide<Sample>* sum,
                                Wide<Sample>* square, Sample* lowest, Sample* highest) {
  for (std::size_t i = 0; i < count; i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Sample value = data[i + lane];
      const auto wide = static_cast<Wide<Sample>>(value);
      sum[lane] += wide;
      square[lane] += wide * wide;
      lowest[lane] = std::min(lowest[lane], value);
      highest[lane] = std::max(highest[lane], value);
    }
  }
}

template <typename Sample>
BlockSums sum_block(const Sample* data, std::size_t frames, std::size_t channels) {
  std::array<Wide<Sample>, kLanes> sum{}, square{};
  std::array<Sample, kLanes> lowest{}, highest{};
  lowest.fill(std::numeric_limits<Sample>::max());
  highest.fill(std::numeric_limits<Sample>::lowest());
  const std::size_t count = frames * channels;
  // Lanes are channels only where the channels divide them, which 1, 2 and 4 do; three go frame by frame.
  const std::size_t whole = kLanes % channels == 0 ? count / kLanes * kLanes : 0;
  sum_lanes(data, whole, sum.data(), square.data(), lowest.data(), highest.data());
  for (std::size_t i = whole; i < count; ++i) {
    const std::size_t lane = i % channels;
    const auto wide = static_cast<Wide<Sample>>(data[i]);
    sum[lane] += wide;
    square[lane] += wide * wide;
    lowest[lane] = std::min(lowest[lane], data[i]);
    highest[lane] = std::max(highest[lane], data[i]);
  }
  BlockSums sums;
  sums.lowest.fill(std::numeric_limits<double>::max());
  sums.highest.fill(std::numeric_limits<double>::lowest());
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::size_t c = lane % channels;
    if (whole == 0 && lane >= channels) break;
    sums.sum[c] += static_cast<double>(sum[lane]);
    sums.square[c] += static_cast<double>(square[lane]);
    sums.lowest[c] = std::min(sums.lowest[c], static_cast<double>(lowest[lane]));
    sums.highest[c] = std::max(sums.highest[c], static_cast<double>(highest[lane]));
  }
  return sums;
}

/// The summarizer for one type of sample.
template <typename Sample>
class Summarizer : public RunSummarizer {
 public:
  Summarizer(const CampaignInfo& campaign, const RawFormat& format, bool with_spectrum)
      : campaign_(campaign),
        channels_(static_cast<std::size_t>(format.channels)),
        scale_V_(is_counts(format.type) ? campaign.daq.volts_per_count() : 1.0),
        block_frames_(std::max<std::size_t>(
            1, static_cast<std::size_t>(std::lround(kBlock_s * campaign.daq.sample_rate_hz)))),
        with_spectrum_(with_spectrum),
        spectrum_(channels_),
        totals_(channels_),
        block_means_(channels_) {
    block_.reserve(block_frames_ * channels_);
  }

  void frames(std::span<const std::byte> data) override {
    std::size_t samples = data.size() / sizeof(Sample);
    const std::byte* from = data.data();
    while (samples > 0) {
      const std::size_t room = block_frames_ * channels_ - block_.size();
      const std::size_t taken = std::min(room, samples);
      const std::size_t old = block_.size();
      block_.resize(old + taken);
      std::memcpy(block_.data() + old, from, taken * sizeof(Sample));
      from += taken * sizeof(Sample);
      samples -= taken;
      if (taken == room) close_block();
    }
  }

  void gap(const Gap& gap) override {
    close_block();
    const std::uint64_t most = kMostWindows * kBlocksPerWindow * block_frames_;
    elapsed_ += std::min(gap.frames_lost, most);
    spectrum_.interrupt();
  }

  RunStatistics finish(const std::string& hash) override {
    close_block();
    spectrum_.finish();
    RunStatistics statistics;
    statistics.hash = hash;
    statistics.frames = frames_;
    statistics.window_s =
        static_cast<double>(kBlocksPerWindow * block_frames_) / campaign_.daq.sample_rate_hz;
    for (std::size_t c = 0; c < channels_; ++c) statistics.channels.push_back(channel(c));
    for (std::size_t w = 0; w < window_frames_.size(); ++w) {
      for (std::size_t c = 0; c < channels_; ++c) {
        statistics.window_means_V.push_back(window_frames_[w] == 0 ? std::numeric_limits<double>::quiet_NaN()
                                                                   : window_sums_[w * channels_ + c] /
                                                                         window_frames_[w] * scale_V_);
      }
    }
    return statistics;
  }

 private:
  struct Total {
    double sum = 0, square = 0;
    double lowest = std::numeric_limits<double>::max(), highest = std::numeric_limits<double>::lowest();
    std::uint64_t clipped = 0;
  };

  void close_block() {
    const std::size_t count = block_.size() / channels_;
    if (count == 0) return;
    const BlockSums sums = sum_block(block_.data(), count, channels_);
    for (std::size_t c = 0; c < channels_; ++c) {
      Total& total = totals_[c];
      total.sum += sums.sum[c];
      total.square += sums.square[c];
      total.lowest = std::min(total.lowest, sums.lowest[c]);
      total.highest = std::max(total.highest, sums.highest[c]);
      if (std::is_integral_v<Sample> &&
          (sums.lowest[c] <= 0 || sums.highest[c] >= campaign_.daq.highest_count())) {
        total.clipped += clipped_in_block(c);
      }
      // A short block, before a gap or at the end, weighs as much as a whole one in the series of blocks:
      // half a block it is.
      if (2 * count >= block_frames_) block_means_[c].push_back(sums.sum[c] / static_cast<double>(count));
    }
    add_to_window(sums, count);
    if (with_spectrum_) add_to_spectrum();
    frames_ += count;
    elapsed_ += count;
    block_.clear();
  }

  std::uint64_t clipped_in_block(std::size_t channel) const {
    std::uint64_t clipped = 0;
    for (std::size_t i = channel; i < block_.size(); i += channels_) {
      clipped += block_[i] <= 0 || static_cast<double>(block_[i]) >= campaign_.daq.highest_count() ? 1 : 0;
    }
    return clipped;
  }

  void add_to_window(const BlockSums& sums, std::size_t count) {
    const auto window = static_cast<std::size_t>(elapsed_ / (kBlocksPerWindow * block_frames_));
    if (window >= kMostWindows) return;
    if (window >= window_frames_.size()) {
      window_frames_.resize(window + 1, 0);
      window_sums_.resize((window + 1) * channels_, 0);
    }
    window_frames_[window] += static_cast<double>(count);
    for (std::size_t c = 0; c < channels_; ++c) window_sums_[window * channels_ + c] += sums.sum[c];
  }

  /// The first frame is taken off, so that single precision is spent on what changes.
  void add_to_spectrum() {
    if (offset_.empty()) {
      for (std::size_t c = 0; c < channels_; ++c) offset_.push_back(static_cast<float>(block_[c]));
    }
    volts_.resize(block_.size());
    const auto scale = static_cast<float>(scale_V_);
    for (std::size_t i = 0; i < block_.size(); i += channels_) {
      for (std::size_t c = 0; c < channels_; ++c) {
        volts_[i + c] = (static_cast<float>(block_[i + c]) - offset_[c]) * scale;
      }
    }
    spectrum_.add(volts_);
  }

  ChannelStatistics channel(std::size_t c) const {
    const Total& total = totals_[c];
    const auto count = static_cast<double>(frames_);
    if (frames_ == 0) return {};
    const double mean = total.sum / count;
    const double variance = std::max(0.0, total.square / count - mean * mean);
    const Trend trend = trend_of(block_means_[c]);
    ChannelStatistics result{.mean_V = mean * scale_V_,
                             .std_V = std::sqrt(variance) * scale_V_,
                             .standard_error_V = standard_error(c, variance) * scale_V_,
                             .drift_V = trend.change * scale_V_,
                             .drift_z = trend.z,
                             .lowest_V = total.lowest * scale_V_,
                             .highest_V = total.highest * scale_V_,
                             .clipped = total.clipped,
                             .shaft_hz = {},
                             .lines = {}};
    if (with_spectrum_) {
      LineList found = find_lines(spectrum_, c, campaign_.daq.sample_rate_hz,
                                  {.shaft_hz = campaign_.rig.nominal_speed_rpm / 60,
                                   .blades = campaign_.rig.blades,
                                   .mains_hz = campaign_.daq.mains_hz});
      result.lines = std::move(found.lines);
      if (found.shaft_hz > 0) result.shaft_hz = found.shaft_hz;
    }
    return result;
  }

  /// In units of the samples. Runs of a few blocks say nothing of their autocorrelation: their frames count
  /// as independent.
  double standard_error(std::size_t c, double variance) const {
    constexpr std::size_t kFewBlocks = 8;
    if (block_means_[c].size() < kFewBlocks) return std::sqrt(variance / static_cast<double>(frames_));
    return std::sqrt(variance_of_mean(block_means_[c]));
  }

  CampaignInfo campaign_;
  std::size_t channels_;
  double scale_V_;
  std::size_t block_frames_;
  bool with_spectrum_;
  WelchSpectrum spectrum_;
  std::vector<Sample> block_;  // samples of the block under way
  std::vector<float> offset_, volts_;
  std::vector<Total> totals_;
  std::vector<std::vector<double>> block_means_;
  std::vector<double> window_sums_, window_frames_;
  std::uint64_t frames_ = 0;   // seen
  std::uint64_t elapsed_ = 0;  // seen or lost
};

}  // namespace

std::unique_ptr<RunSummarizer> make_run_summarizer(const CampaignInfo& campaign, const RawFormat& format,
                                                   bool with_spectrum) {
  switch (format.type) {
    case SampleType::kInt16:
      return std::make_unique<Summarizer<std::int16_t>>(campaign, format, with_spectrum);
    case SampleType::kUInt16:
      return std::make_unique<Summarizer<std::uint16_t>>(campaign, format, with_spectrum);
    case SampleType::kFloat32:
      return std::make_unique<Summarizer<float>>(campaign, format, with_spectrum);
    case SampleType::kFloat64:
      return std::make_unique<Summarizer<double>>(campaign, format, with_spectrum);
  }
  return nullptr;
}

}  // namespace tunnelrig
