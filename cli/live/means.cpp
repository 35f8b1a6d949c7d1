#include "cli/live/means.h"

#include "analysis/air.h"
#include "analysis/autocorrelation.h"
#include "analysis/reduction.h"
#include "calibration/distributions.h"
#include "datasets/thesis.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig::live {
namespace {

constexpr std::size_t kFewestBlocks = 8;

/// Half of the 95 % interval of a series' mean; as many degrees of freedom as it has independent values.
std::optional<double> u95_of(const std::vector<double>& series) {
  if (series.size() < kFewestBlocks) return {};
  const double of_mean = variance_of_mean(series);
  if (of_mean <= 0) return 0;
  const auto n = static_cast<double>(series.size());
  double sum = 0, square = 0;
  for (const double value : series) {
    sum += value / n;
    square += value * value / n;
  }
  const double independent = std::max(2.0, (square - sum * sum) / of_mean);
  return half_width_95(std::sqrt(of_mean), std::min(independent - 1, n));
}

}  // namespace

RunningMeans running_means(const RunningBlocks& blocks, const Scale& scale, const CampaignInfo& info,
                           std::optional<double> air_temperature_C) {
  RunningMeans means;
  const auto mean = blocks.mean();
  const auto rotors = static_cast<std::size_t>(info.rig.rotors);
  std::vector<double> series(blocks.blocks().size());
  for (std::size_t c = 0; c < rotors; ++c) {
    // about the mean, so that squares keep their digits
    for (std::size_t b = 0; b < series.size(); ++b)
      series[b] = scale.slope[c] * (blocks.blocks()[b][c] - mean[c]);
    means.rotors.push_back({scale.value(c, mean[c]), u95_of(series)});
  }
  if (!scale.newtons) return means;
  RunCoefficients run;
  for (std::size_t c = 0; c < rotors; ++c) run.thrust_N[c] = means.rotors[c].mean;
  run.density_kg_m3 =
      dry_air_density_kg_m3(thesis::kPressure_Pa, air_temperature_C.value_or(15) + kZeroCelsius_K);
  run.speed_rpm = info.rig.nominal_speed_rpm;
  set_coefficients(info, run);
  if (!(run.total_N > 0)) return means;
  const auto known = [&](double value, const std::array<double, kMaxRotors>& per_thrust) {
    for (std::size_t b = 0; b < series.size(); ++b) {
      series[b] = 0;
      for (std::size_t c = 0; c < rotors; ++c)
        series[b] += per_thrust[c] * scale.slope[c] * (blocks.blocks()[b][c] - mean[c]);
    }
    return KnownMean{value, u95_of(series)};
  };
  if (air_temperature_C) means.c_t = known(run.c_t, c_t_per_thrust(run, info.rig));
  if (std::isfinite(run.u_percent)) means.u_percent = known(run.u_percent, u_per_thrust(run));
  return means;
}

}  // namespace tunnelrig::live
