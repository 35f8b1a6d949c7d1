#include "analysis/misread_runs.h"

#include "analysis/reduction.h"
#include "analysis/upper_median.h"
#include "datasets/first_few.h"

#include <cmath>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

constexpr double kLoaded = 0.5, kUncertain = 0.05;  // of the median thrust

using OfRotors = std::vector<double>;

OfRotors forces_N(const CampaignData& data, const std::string& run) {
  OfRotors force_N;
  const RunStatistics& statistics = data.statistics.at(run);
  for (int rotor = 0; rotor < data.info.rig.rotors; ++rotor)
    force_N.push_back(
        data.certificate->force(rotor + 1, statistics.channels[static_cast<std::size_t>(rotor)].mean_V)
            .force_N);
  return force_N;
}

OfRotors medians(const std::vector<OfRotors>& runs, std::size_t rotors) {
  OfRotors result;
  for (std::size_t c = 0; c < rotors; ++c) {
    std::vector<double> of_rotor;
    for (const OfRotors& run : runs) of_rotor.push_back(run[c]);
    result.push_back(upper_median(std::move(of_rotor)));
  }
  return result;
}

}  // namespace

MisreadRuns misread_runs(const CampaignData& data) {
  constexpr std::size_t kFewestTares = 3;  // of two, nothing says which is the loaded one
  MisreadRuns result;
  const auto rotors = static_cast<std::size_t>(data.info.rig.rotors);
  const std::vector<std::size_t> thrusts = recorded_runs(data, RunKind::kThrust),
                                 tares = recorded_runs(data, RunKind::kTare);
  if (!data.certificate || thrusts.empty()) return result;
  const auto forces_of = [&](const std::vector<std::size_t>& runs) {
    std::vector<OfRotors> all;
    for (const std::size_t r : runs) all.push_back(forces_N(data, data.runs[r].run));
    return all;
  };
  const std::vector<OfRotors> of_tares = forces_of(tares);
  OfRotors zero_N(rotors, 0), thrust_N = medians(forces_of(thrusts), rotors);
  if (tares.size() >= kFewestTares) zero_N = medians(of_tares, rotors);
  for (std::size_t c = 0; c < rotors; ++c) thrust_N[c] = std::abs(thrust_N[c] - zero_N[c]);
  for (std::size_t k = 0; k < tares.size(); ++k) {
    std::size_t loaded = 0;
    for (std::size_t c = 0; c < rotors; ++c)
      loaded += std::abs(of_tares[k][c] - zero_N[c]) > kLoaded * thrust_N[c] ? 1 : 0;
    if (2 * loaded > rotors) result.loaded_tares.push_back(data.runs[tares[k]].run);
  }
  for (const std::size_t r : thrusts) {
    const RunStatistics& statistics = data.statistics.at(data.runs[r].run);
    bool broken = false;
    for (std::size_t c = 0; c < rotors; ++c) {
      const ChannelStatistics& channel = statistics.channels[c];
      const double slope = data.certificate->force(static_cast<int>(c) + 1, channel.mean_V).d_voltage_N_per_V;
      broken |= std::abs(slope) * channel.standard_error_V > kUncertain * thrust_N[c];
    }
    if (broken) result.broken_off.push_back(data.runs[r].run);
  }
  return result;
}

std::vector<std::string> in_words(const MisreadRuns& runs) {
  constexpr std::size_t kNamed = 6;
  std::vector<std::string> sentences;
  if (!runs.loaded_tares.empty())
    sentences.push_back(
        fmt::format("{}: tares that are loaded like thrust runs, and shift the zeros of their sessions "
                    "(`tunnelrig doctor`)",
                    first_few(runs.loaded_tares, kNamed)));
  if (!runs.broken_off.empty())
    sentences.push_back(
        fmt::format("{}: not one state, their means are known to no better than 5 % (`tunnelrig doctor`)",
                    first_few(runs.broken_off, kNamed)));
  return sentences;
}

}  // namespace tunnelrig
