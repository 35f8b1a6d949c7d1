// Conditions that the raw data of a campaign's runs show.
#include "analysis/residual/observations/campaign_conditions.h"
#include "analysis/spectrum.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Of those of a channel's lines together that `chosen` accepts.
template <class Chosen>
double amplitude_of_lines_V(const ChannelStatistics& channel, const Chosen& chosen) {
  double amplitude_V = 0;
  for (const SpectralLine& line : channel.lines)
    if (chosen(line)) amplitude_V += line.amplitude_V;
  return amplitude_V;
}

double alias_amplitude_V(const ChannelStatistics& channel) {
  return amplitude_of_lines_V(
      channel, [](const SpectralLine& line) { return line.name.find("alias") != line.name.npos; });
}

double vibration_amplitude_V(const ChannelStatistics& channel) {
  return amplitude_of_lines_V(
      channel, [](const SpectralLine& line) { return line.name == "shaft" || line.name == "blade_pass"; });
}

double clip_fraction(const RunStatistics& run, const ChannelStatistics& channel) {
  return static_cast<double>(channel.clipped) / static_cast<double>(run.frames);
}

/// A spike now and then makes no lines.
bool clips(const RunStatistics& run) {
  constexpr double kClips = 1e-3;
  return std::ranges::any_of(run.channels,
                             [&](const ChannelStatistics& c) { return clip_fraction(run, c) > kClips; });
}

/// Hum of the grid that the campaign says it is not on: a line without another name, at 50 or at 60 Hz, in
/// most runs.
void warn_of_another_grid(const std::vector<const RunStatistics*>& of_rows, const Daq& daq,
                          Observations& observations) {
  if (!daq.mains_hz) return;
  for (const double grid_hz : {50.0, 60.0}) {
    if (may_be_hum(grid_hz, daq.sample_rate_hz, daq.mains_hz)) continue;
    const auto hums = [&](const RunStatistics* run) {
      return run != nullptr && std::ranges::any_of(run->channels, [&](const ChannelStatistics& channel) {
               return std::ranges::any_of(channel.lines, [&](const SpectralLine& line) {
                 return line.name.empty() && may_be_hum(line.frequency_hz, daq.sample_rate_hz, grid_hz);
               });
             });
    };
    const auto runs = std::ranges::count_if(of_rows, hums);
    if (2 * runs > std::ssize(of_rows))
      observations.left_out.push_back(fmt::format(
          "{} of {} runs have a line at {:g} Hz that is no multiple of the shaft's: mains_hz = {:g} "
          "in campaign.toml may be wrong, and hum is counted in mains_amplitude_V at that alone",
          runs, of_rows.size(), grid_hz, *daq.mains_hz));
  }
}

}  // namespace

double mains_amplitude_V(const ChannelStatistics& channel, const Daq& daq) {
  return amplitude_of_lines_V(channel, [&](const SpectralLine& line) {
    return is_mains(line.name) ||
           (line.name == "shaft" && may_be_hum(line.frequency_hz, daq.sample_rate_hz, daq.mains_hz));
  });
}

void add_raw_conditions(const std::vector<const RunStatistics*>& of_rows, const Daq& daq,
                        Observations& observations) {
  const auto runs = std::ssize(of_rows);
  const auto missing = std::ranges::count(of_rows, nullptr);
  if (missing == runs) return;
  const auto add = [&](const std::string& name, const auto& value_of) {
    if (observations.find(name) != nullptr) return;  // a column of runs.csv goes before
    Covariate covariate{name, MatrixXd::Constant(observations.rows(), observations.channels(), kUnknown),
                        true};
    for (Index row = 0; row < observations.rows(); ++row)
      for (Index c = 0; c < observations.channels(); ++c)
        if (const RunStatistics* run = of_rows[static_cast<std::size_t>(row)])
          covariate.value(row, c) = value_of(*run, run->channels[static_cast<std::size_t>(c)]);
    if (missing > 0) observations.not_usable[name] = fmt::format("missing in {} of {} runs", missing, runs);
    observations.covariates.push_back(std::move(covariate));
  };
  using OfRun = const RunStatistics&;
  using OfChannel = const ChannelStatistics&;
  add("clip_fraction", clip_fraction);
  add("mains_amplitude_V", [&](OfRun, OfChannel channel) { return mains_amplitude_V(channel, daq); });
  add("alias_amplitude_V",
      [](OfRun run, OfChannel channel) { return clips(run) ? kUnknown : alias_amplitude_V(channel); });
  add("vibration_amplitude_V", [](OfRun, OfChannel channel) { return vibration_amplitude_V(channel); });
  warn_of_another_grid(of_rows, daq, observations);
  const auto clipped =
      std::ranges::count_if(of_rows, [](const RunStatistics* run) { return run && clips(*run); });
  if (clipped > 0 && observations.find("alias_amplitude_V")->derived)
    observations.not_usable["alias_amplitude_V"] =
        fmt::format("missing in {} of {} runs, of which {} were clipped, which makes such lines as well",
                    missing + clipped, runs, clipped);
}

}  // namespace tunnelrig
