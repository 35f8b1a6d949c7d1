// The decimation filter against the response that its header and docs/hardware.md promise.
#include "decimator.h"

#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

namespace {

constexpr double kConversion_hz = 8 * 4000.0 / 3.0;

double tap(int i) { return decimator_taps[i < DECIMATOR_TAPS / 2 ? i : DECIMATOR_TAPS - 1 - i] / 32768.0; }

double response_dB(double frequency_hz) {
  std::complex<double> sum = 0;
  for (int i = 0; i < DECIMATOR_TAPS; ++i) {
    sum += tap(i) * std::polar(1.0, -2 * std::numbers::pi * frequency_hz / kConversion_hz * i);
  }
  return 20 * std::log10(std::abs(sum));
}

TEST(Decimator, ResponseIsTheDocumentedOne) {
  double sum = 0;
  for (int i = 0; i < DECIMATOR_TAPS; ++i) sum += tap(i);
  EXPECT_EQ(sum, 1.0);
  for (int f = 0; f <= 460; ++f) EXPECT_NEAR(response_dB(f), 0, 0.01) << f;
  EXPECT_NEAR(response_dB(2000.0 / 3.0), -6, 0.1);
  for (int f = 867; f <= kConversion_hz / 2; ++f) EXPECT_LT(response_dB(f), -57) << f;
}

/// Amplitude at the output of a sine of 1000 counts at the input.
double amplitude_through(double frequency_hz) {
  decimator filter{};
  decimator_reset(&filter);
  double peak = 0;
  for (int frame = 0; frame < 4000; ++frame) {
    std::array<uint16_t, 32> scans{};
    for (int i = 0; i < 8; ++i) {
      const double t = (8 * frame + i) / kConversion_hz;
      const double value = 2048 + 1000 * std::sin(2 * std::numbers::pi * frequency_hz * t);
      for (std::size_t c = 0; c < 4; ++c)
        scans[static_cast<std::size_t>(i) * 4 + c] = static_cast<uint16_t>(std::lround(value));
    }
    std::array<int16_t, 4> out{};
    decimator_step(&filter, scans.data(), out.data());
    EXPECT_EQ(out[0], out[3]);
    if (frame > 20) peak = std::max(peak, std::abs(out[1] - 2048.0));
  }
  return peak;
}

TEST(Decimator, PassesTheSignalAndNotItsAliases) {
  EXPECT_NEAR(amplitude_through(83.3), 1000, 3) << "the shaft at 5000 rev/min";
  EXPECT_NEAR(amplitude_through(166.7), 1000, 3) << "blade pass";
  EXPECT_LT(amplitude_through(1333.3 - 83.3), 2) << "would fold back onto the shaft";
  EXPECT_LT(amplitude_through(1333.3 - 166.7), 2);
  EXPECT_LT(amplitude_through(2666.7 + 83.3), 2);
}

TEST(Decimator, StartsWithoutRingingAndHoldsTheRails) {
  for (const uint16_t level : {uint16_t{0}, uint16_t{1}, uint16_t{2047}, uint16_t{4095}}) {
    decimator filter{};
    decimator_reset(&filter);
    std::array<uint16_t, 32> scans{};
    scans.fill(level);
    for (int frame = 0; frame < 30; ++frame) {
      std::array<int16_t, 4> out{};
      decimator_step(&filter, scans.data(), out.data());
      EXPECT_EQ(out[2], level) << frame;
    }
  }
}

}  // namespace
