#include "attribution/generator/raw_runs.h"

#include "datasets/campaign.h"
#include "datasets/npy.h"

#include <cstring>
#include <fstream>
#include <numbers>

#include <fmt/format.h>

namespace tunnelrig::attribution {
namespace {

constexpr double kShaft_Hz = kNominalSpeed_rpm / 60;
constexpr double kShaft_V = 0.05, kBladePass_V = 0.03;
constexpr double kWindow_s = 0.1;  // slow changes are followed in steps of this

/// Noise of the cell under a turning rotor: white, and a slower part with a memory of a few hundredths of a
/// second.
class CellNoise {
 public:
  explicit CellNoise(Random& random) : random_(random) {}
  double next() {
    slow_ = 0.97 * slow_ + random_.normal(0.001);
    return slow_ + random_.normal(0.004);
  }

 private:
  Random& random_;
  double slow_ = 0;
};

double waveform_V(const Campaign& campaign, std::size_t run, std::size_t rotor, double time_s) {
  double volts = 0;
  for (const Sized& one : campaign.effects) {
    const Effect& effect = one.effect;
    if (!effect.waveform_V || (effect.rotor && *effect.rotor != rotor)) continue;
    volts += effect.waveform_V({campaign.world, run, rotor, time_s}, one.amplitude);
  }
  return volts;
}

void fill_channel(const Campaign& campaign, std::size_t run, std::size_t rotor, const Daq& daq,
                  Random& random, std::vector<std::int16_t>& counts) {
  CellNoise noise(random);
  const double phase = random.uniform(0, 2 * std::numbers::pi);
  const double speed_Hz = kShaft_Hz * campaign.world.runs[run].speed_rpm / kNominalSpeed_rpm;
  const auto window = static_cast<std::size_t>(kWindow_s * daq.sample_rate_hz);
  double level_V = 0;
  for (std::size_t frame = 0; frame < counts.size() / kRotors; ++frame) {
    const double time_s = static_cast<double>(frame) / daq.sample_rate_hz;
    if (frame % window == 0) {
      level_V = kZero_V + kGain_V_N * campaign.world.baseline_N[run][rotor] *
                              reading_over_baseline(campaign, run, rotor, time_s + kWindow_s / 2);
    }
    const double turn = 2 * std::numbers::pi * speed_Hz * time_s + phase;
    const double volts = level_V + kShaft_V * std::sin(turn) + kBladePass_V * std::sin(2 * turn) +
                         noise.next() + waveform_V(campaign, run, rotor, time_s);
    const double count = std::round(volts / daq.volts_per_count());
    counts[frame * kRotors + rotor] =
        static_cast<std::int16_t>(std::clamp(count, 0.0, static_cast<double>(daq.highest_count())));
  }
}

}  // namespace

void write_raw_runs(const Campaign& campaign, const std::filesystem::path& folder) {
  const Daq daq;
  std::filesystem::create_directories(folder / "raw");
  Random random(campaign.settings.seed, "cells");
  const auto frames = static_cast<std::uint64_t>(campaign.settings.raw_duration_s * daq.sample_rate_hz);
  std::vector<std::int16_t> counts(frames * kRotors);
  for (std::size_t run = 0; run < campaign.world.runs.size(); ++run) {
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor)
      fill_channel(campaign, run, rotor, daq, random, counts);
    std::ofstream out(folder / fmt::format("raw/R{:04}.npy", run + 1), std::ios::binary);
    out << format_npy_header({}, frames);
    out.write(reinterpret_cast<const char*>(counts.data()),
              static_cast<std::streamsize>(counts.size() * sizeof(std::int16_t)));
  }
}

}  // namespace tunnelrig::attribution
