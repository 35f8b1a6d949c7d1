// The spectrum of the newest frames, and where shaft, blade-pass and mains lines must appear in it.
#pragma once

#include "cli/live/scale.h"
#include "daq/live/frame_window.h"

#include <optional>
#include <string>
#include <vector>

namespace tunnelrig::live {

struct MarkedLine {
  std::string name;  // "shaft", "blade pass ×2", "mains ×3"
  double frequency_hz = 0;
  double appears_hz = 0;  // after sampling
  bool alias = false;
};

struct LiveSpectrum {
  double df_hz = 0;
  std::vector<std::vector<double>> amplitude;  // rotor by rotor, bins from 0; peak amplitudes, in the unit
  std::optional<double> shaft_hz;              // as seen by the middle one of the rotors that show it
  std::vector<MarkedLine> lines;
};

/// Frames that a spectrum takes: three half-overlapped Hann windows of 2048.
inline constexpr std::size_t kSpectrumFrames = 4096;

/// `frames` is full. The shaft is looked for at the nominal speed of `info` (the run's own: `at_speed`);
/// lines are marked by the shaft that is seen, else by that speed.
LiveSpectrum live_spectrum(const FrameWindow& frames, const Scale& scale, const CampaignInfo& info);

/// "{"t_s":…,"df_hz":…,…}" as the page reads it.
std::string spectrum_json(const LiveSpectrum& spectrum, double t_s, const char* unit);

}  // namespace tunnelrig::live
