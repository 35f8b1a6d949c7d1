#include "analysis/residual/search/detectable.h"

#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

namespace tunnelrig {

Detectable detectable_by(const SearchData& data, const Found& found, const Scan& scan, double otherwise) {
  std::map<std::string, std::vector<std::pair<double, std::size_t>>> errors;  // rms of one; of each way
  for (std::size_t i = 0; i < scan.candidates.size(); ++i) {
    const Term& way = scan.ways[i];
    const bool alike = way.rotor < 0 || way.effect->scope == EffectScope::kPair;
    if (!alike || way.per_group || scan.others.contains(i)) continue;
    const double z = std::sqrt(2 * scan.fits[i].likelihood_ratio);
    const double size =
        std::abs(scan.fits[i].amplitude(0)) * rms_beside_baseline(data, scan.candidates[i].columns[0][0]);
    if (z > 0 && size > 0) errors[way.effect->name].emplace_back(size / z, i);
  }
  if (errors.empty()) return {.largest = otherwise};
  std::vector<std::string> names;
  std::vector<Candidate> typical;
  for (auto& [name, ways] : errors) {
    std::sort(ways.begin(), ways.end());
    names.push_back(name);
    typical.push_back(scan.candidates[ways[ways.size() / 2].second]);
  }
  constexpr std::size_t kDataSets = 100, kFourInFive = 80;
  std::mt19937_64 random(data.settings().seed);
  const Eigen::MatrixXd amplitude =
      CandidateScan(data.mixed(), {}, typical)
          .critical_amplitudes(found.fit.variances, found.critical, kDataSets, random);
  Detectable result;
  for (std::size_t i = 0; i < names.size(); ++i) {
    Eigen::VectorXd own = amplitude.col(static_cast<Eigen::Index>(i));
    std::nth_element(own.begin(), own.begin() + kFourInFive - 1, own.end());
    const double needed = own(kFourInFive - 1) * rms_beside_baseline(data, typical[i].columns[0][0]);
    if (!std::isfinite(needed)) continue;
    result.by_effect[names[i]] = needed;
    result.largest = std::max(result.largest, needed);
  }
  if (!(result.largest > 0)) result.largest = otherwise;
  return result;
}

double detectable_by_one(const MixedModel& mixed, const NullFit& variances, double alpha) {
  const Eigen::RowVectorXd of_all = mixed.mode_matrix().colwise().sum();
  double information = 0;
  for (std::size_t s = 0; s < mixed.strata().size(); ++s) {
    const MixedModel::Stratum& stratum = mixed.strata()[s];
    if (!stratum.means()) continue;
    const double runs = static_cast<double>(std::max<Eigen::Index>(mixed.dof(s) / stratum.modes, 1));
    information += runs * of_all.segment(stratum.first_mode, stratum.modes).squaredNorm() /
                   (std::pow(variances.sigma[s], 2) * (1 + kRatios[variances.ratio[s]]));
  }
  constexpr double kPower = 0.8;
  return (normal_quantile(1 - alpha / 2) + normal_quantile(kPower)) / std::sqrt(information);
}

}  // namespace tunnelrig
