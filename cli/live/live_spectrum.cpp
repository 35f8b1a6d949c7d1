#include "cli/live/live_spectrum.h"

#include "analysis/spectrum.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

namespace tunnelrig::live {
namespace {

constexpr int kBladeHarmonics = 5;  // the last are aliases at the usual rate
constexpr int kMainsHarmonics = 3;

MarkedLine marked(const std::string& name, double frequency_hz, double rate_hz) {
  return {name, frequency_hz, folded(frequency_hz, rate_hz), frequency_hz > rate_hz / 2};
}

std::string harmonic(const char* name, int k) { return k == 1 ? name : fmt::format("{} ×{}", name, k); }

}  // namespace

LiveSpectrum live_spectrum(const FrameWindow& frames, const Scale& scale, const CampaignInfo& info) {
  const auto rotors = static_cast<std::size_t>(info.rig.rotors);
  const double rate_hz = info.daq.sample_rate_hz;
  std::vector<float> samples;
  samples.reserve(frames.frames().size() * rotors);
  const LiveFrame& first = frames.frames().front();
  for (const LiveFrame& frame : frames.frames()) {
    for (std::size_t c = 0; c < rotors; ++c)
      samples.push_back(static_cast<float>((frame.counts[c] - first.counts[c]) * scale.slope[c]));
  }
  WelchSpectrum welch(rotors);
  welch.add(samples);
  welch.finish();

  LiveSpectrum spectrum{
      .df_hz = rate_hz / static_cast<double>(welch.window()), .amplitude = {}, .shaft_hz = {}, .lines = {}};
  std::vector<double> shafts;
  for (std::size_t c = 0; c < rotors; ++c) {
    std::vector<double> amplitude;
    const auto power = welch.power(c);
    std::transform(power.begin(), power.end(), std::back_inserter(amplitude),
                   [](double value) { return std::sqrt(value); });
    spectrum.amplitude.push_back(std::move(amplitude));
    const double seen_hz = find_lines(welch, c, rate_hz,
                                      {.shaft_hz = info.rig.nominal_speed_rpm / 60,
                                       .blades = info.rig.blades,
                                       .mains_hz = info.daq.mains_hz})
                               .shaft_hz;
    if (seen_hz > 0) shafts.push_back(seen_hz);
  }
  if (!shafts.empty()) {
    std::sort(shafts.begin(), shafts.end());
    spectrum.shaft_hz = shafts[shafts.size() / 2];
  }
  const double shaft_hz = spectrum.shaft_hz.value_or(info.rig.nominal_speed_rpm / 60);
  spectrum.lines.push_back(marked("shaft", shaft_hz, rate_hz));
  for (int k = 1; k <= kBladeHarmonics; ++k)
    spectrum.lines.push_back(marked(harmonic("blade pass", k), k * info.rig.blades * shaft_hz, rate_hz));
  for (int k = 1; k <= kMainsHarmonics; ++k)
    spectrum.lines.push_back(
        marked(harmonic("mains", k), k * info.daq.mains_hz.value_or(kUsualMains_hz), rate_hz));
  return spectrum;
}

std::string spectrum_json(const LiveSpectrum& spectrum, double t_s, const char* unit) {
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "{{\"t_s\":{:.3f},\"df_hz\":{:.6f},\"unit\":\"{}\",\"amplitude\":[", t_s, spectrum.df_hz,
                 unit);
  for (std::size_t c = 0; c < spectrum.amplitude.size(); ++c) {
    fmt::format_to(to, "{}[", c == 0 ? "" : ",");
    for (std::size_t k = 0; k < spectrum.amplitude[c].size(); ++k)
      fmt::format_to(to, "{}{:.3g}", k == 0 ? "" : ",", spectrum.amplitude[c][k]);
    fmt::format_to(to, "]");
  }
  fmt::format_to(to, "],\"lines\":[");
  for (std::size_t i = 0; i < spectrum.lines.size(); ++i) {
    const MarkedLine& line = spectrum.lines[i];
    fmt::format_to(to, "{}{{\"name\":\"{}\",\"frequency_hz\":{:.3f},\"appears_hz\":{:.3f},\"alias\":{}}}",
                   i == 0 ? "" : ",", line.name, line.frequency_hz, line.appears_hz, line.alias);
  }
  fmt::format_to(to, "]}}");
  return fmt::to_string(out);
}

}  // namespace tunnelrig::live
