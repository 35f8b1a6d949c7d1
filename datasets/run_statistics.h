// What is kept of a run's raw data: computed once while the frames pass (analysis/run_summary.h), stored,
// read ever after.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

/// A line of one channel's spectrum.
struct SpectralLine {
  double frequency_hz = 0;
  double amplitude_V = 0;  // peak amplitude of the sinusoid
  double prominence = 0;   // power over the noise around it
  std::string name;        // "shaft", "blade_pass", "mains_50", …; empty where nothing is known of it
};

/// Less noise than this and a channel is dead: the converter itself makes more.
inline constexpr double kDeadNoise_counts = 0.25;

/// One channel of one run, in volts.
struct ChannelStatistics {
  double mean_V = 0;
  double std_V = 0;
  double standard_error_V = 0;  // of the mean, autocorrelation included
  double drift_V = 0;           // straight line through the run, end minus start
  double drift_z = 0;  // the drift over its own standard error, as a normal deviation whatever the blocks
  double lowest_V = 0;
  double highest_V = 0;
  std::uint64_t clipped = 0;  // samples at the end of the converter's range
  std::optional<double> shaft_hz;
  std::vector<SpectralLine> lines;

  bool stuck() const { return lowest_V == highest_V; }

  /// The mean means something: no drift beyond what the noise of the run explains, once four channels of
  /// hundreds of runs are looked at (|z| of 4.5 is seven in a million).
  bool stationary() const { return drift_z > -4.5 && drift_z < 4.5; }
};

/// One run.
struct RunStatistics {
  std::string hash;  // of the raw data that they were computed from
  std::uint64_t frames = 0;
  std::vector<ChannelStatistics> channels;
  double window_s = 0;
  std::vector<double>
      window_means_V;  // windows × channels, consecutive in time; NaN where every frame was lost

  /// From the first frame to the last, lost ones between them included (to a window).
  double elapsed_s(double sample_rate_hz) const {
    const double stored_s = static_cast<double>(frames) / sample_rate_hz;
    const std::size_t windows = channels.empty() ? 0 : window_means_V.size() / channels.size();
    return windows == 0 ? stored_s : std::max(stored_s, static_cast<double>(windows - 1) * window_s);
  }
};

}  // namespace tunnelrig
