// Spectra of the channels of a run, and the lines in them.
#pragma once

#include "datasets/run_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// Welch's averaged periodogram of several channels: Hann windows of 4096 frames, half overlapped; shorter
/// for runs of fewer than 8192 frames (docs/run-statistics.md).
class WelchSpectrum {
 public:
  explicit WelchSpectrum(std::size_t channels);

  /// Consecutive frames, channel by channel within a frame, in volts less anything constant.
  void add(std::span<const float> frames);

  /// Frames are missing here: no window reaches across, but among the first 8192 frames, before which their
  /// length is not chosen.
  void interrupt();

  /// The run is over: averages of the power of bins 0 … window/2, channel after channel; empty for fewer than
  /// 256 frames.
  void finish();

  std::size_t window() const { return window_; }
  std::size_t segments() const { return segments_; }

  /// Power of one channel, scaled so that a sinusoid of amplitude A at the middle of a bin gives A².
  std::span<const double> power(std::size_t channel) const;

 private:
  void transform(std::size_t first_frame);
  void transform_waiting(bool all);
  void choose_window(std::size_t window);

  std::size_t channels_;
  std::size_t window_ = 0;  // frames; 0 until chosen
  std::size_t segments_ = 0;
  std::vector<float> waiting_;  // frames not yet done with
  std::vector<float> taper_;
  std::vector<double> power_;
};

/// Frames of a window of a run of so many frames; 0 where they are too few for a spectrum.
std::size_t welch_window(std::size_t frames);

/// What a line's frequency is uncertain by (1 σ), in bins.
inline constexpr double kLineError_bins = 0.3;

/// Where a frequency appears after sampling.
inline double folded(double frequency_hz, double rate_hz) {
  const double rest = std::fmod(frequency_hz, rate_hz);
  return std::min(rest, rate_hz - rest);
}

/// A line at the mains' frequency or one of its harmonics, by its name.
inline bool is_mains(std::string_view name) { return name.starts_with("mains"); }

/// Whether a line may be the mains' own: within a bin and a half of 4096 frames of 50 or 60 Hz, whichever the
/// grid has.
bool may_be_hum(double frequency_hz, double rate_hz, const std::optional<double>& mains_hz);

/// What the lines of a run may be of.
struct LineSources {
  double shaft_hz = 0;  // about where its line is expected
  int blades = 2;
  std::optional<double> mains_hz = {};  // of the grid; not known: 50 or 60 Hz
};

/// The lines of a spectrum, strongest first, at most twelve; named after the shaft (shaft, blade_pass =
/// as many times the shaft as a propeller has blades, shaft_x3 …, with _alias beyond the Nyquist frequency)
/// or the mains (mains_50 …). The shaft's is the strongest within 4 % of where it is expected, if it stands
/// out; what may be hum is not, beside another there of a twentieth of it. A line of the mains is none that a
/// multiple of the shaft may be.
struct LineList {
  std::vector<SpectralLine> lines;
  double shaft_hz = 0;  // 0: none found
};
LineList find_lines(const WelchSpectrum& spectrum, std::size_t channel, double rate_hz,
                    const LineSources& sources);

/// The run's shaft as seen by the middle one of the channels that show its line, of an even number the mean
/// of the two: one that takes another line for it decides nothing.
std::optional<double> middle_shaft_hz(const RunStatistics& statistics);

}  // namespace tunnelrig
