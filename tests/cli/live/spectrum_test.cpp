#include "cli/live/live_spectrum.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace tunnelrig::live {
namespace {

/// Two lines and a converter's noise.
FrameWindow two_lines(double strong_hz, double weak_hz, double rate_hz) {
  FrameWindow frames(kSpectrumFrames);
  std::mt19937_64 engine(1);
  std::normal_distribution<double> noise;
  for (std::size_t i = 0; i < kSpectrumFrames; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / rate_hz;
    const double counts =
        200 * std::sin(strong_hz * angle) + 40 * std::sin(weak_hz * angle) + noise(engine) + 2000;
    const auto sample = static_cast<std::int16_t>(std::lround(counts));
    frames.add({.index = i, .counts = {sample, sample, sample, sample}});
  }
  return frames;
}

/// A shaft of some 3000 rev/min may be at 50 Hz: its line is no hum where the grid is said to have 60 Hz, and
/// is taken for it where nothing is said, or 50 Hz.
TEST(LiveSpectrum, LooksForTheShaftBesideTheHumOfTheGridThatThereIs) {
  CampaignInfo info;
  info.rig.nominal_speed_rpm = 3050;
  const FrameWindow frames = two_lines(50, 52.5, info.daq.sample_rate_hz);
  const Scale scale{.slope = {1e-3, 1e-3, 1e-3, 1e-3}};
  for (const std::optional<double> mains_hz : {std::optional<double>(), std::optional(50.0)}) {
    info.daq.mains_hz = mains_hz;
    EXPECT_NEAR(live_spectrum(frames, scale, info).shaft_hz.value(), 52.5, 0.1);
  }
  info.daq.mains_hz = 60;
  EXPECT_NEAR(live_spectrum(frames, scale, info).shaft_hz.value(), 50, 0.1);
}

}  // namespace
}  // namespace tunnelrig::live
