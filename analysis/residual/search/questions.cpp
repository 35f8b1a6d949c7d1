#include "analysis/residual/search/questions.h"

#include <algorithm>
#include <utility>

namespace tunnelrig {
namespace {

/// Runs so far off that data sets with them would be made by them alone, the furthest first. `sizes`: rms 1.
std::vector<Eigen::Index> far_runs(const std::vector<Eigen::MatrixXd>& sizes, std::size_t most) {
  constexpr double kFar = 5;
  std::vector<std::pair<double, Eigen::Index>> far;
  for (const Eigen::MatrixXd& of_stratum : sizes)
    for (Eigen::Index run = 0; run < of_stratum.rows(); ++run)
      if (const double size = of_stratum.row(run).maxCoeff(); size > kFar) far.emplace_back(size, run);
  std::sort(far.rbegin(), far.rend());
  std::vector<Eigen::Index> runs;
  for (const auto& [size, run] : far)
    if (runs.size() < most && std::find(runs.begin(), runs.end(), run) == runs.end()) runs.push_back(run);
  return runs;
}

/// Whether a candidate has most of its evidence from the runs but for these (places among the rows).
bool is_found_without(const SearchData& data, const std::vector<Eigen::Index>& places, const JointFit& fit,
                      const Candidate& candidate, const CandidateFit& found) {
  constexpr double kMost = 0.7;
  const Eigen::Index channels = data.y()[0].cols();
  Components nothing;
  for (const Eigen::MatrixXd& component : data.y())
    nothing.push_back(Eigen::MatrixXd::Zero(component.rows(), component.cols()));
  std::vector<Components> columns = fit.linear.columns;
  for (const Eigen::Index place : places)
    for (Eigen::Index channel = 0; channel < channels; ++channel) {
      columns.push_back(nothing);
      columns.back()[0](data.rows()[static_cast<std::size_t>(place)], channel) = 1;
    }
  const CandidateScan scan(data.mixed(), columns, {candidate});
  return scan.fit(difference(data.y(), fit.linear.offset))[0].evidence > kMost * found.evidence;
}

/// For the data that are drawn once more: scatter may go with anything, but what a candidate explains of the
/// runs is none. Nothing of few runs, whose signs make too few data sets.
std::vector<Eigen::MatrixXd> sizes_beside(const SearchData& data, const JointFit& fit,
                                          const Candidate& candidate, const CandidateFit& found) {
  constexpr Eigen::Index kFewest = 20;
  constexpr std::size_t kMostFar = 3;
  if (data.mixed().dof(0) < kFewest) return {};
  const Components y = difference(data.y(), fit.linear.offset);
  const auto sizes = [&](const std::vector<Eigen::Index>& as_they_are) {
    return data.mixed().sizes_left(fit.variances.ratio, fit.variances.sigma, y, candidate.columns,
                                   found.amplitude, as_they_are);
  };
  auto result = sizes({});
  // Where a condition has one value far out, a curve that is only nearly right is far off without that run.
  const std::vector<Eigen::Index> far = far_runs(result, kMostFar);
  return far.empty() || !is_found_without(data, far, fit, candidate, found) ? result : sizes(far);
}

}  // namespace

NullMaxima Questions::maxima_of(const SearchData& data, const JointFit& fit, const Scan& scan, Draws what,
                                const SearchSettings& settings) {
  const std::size_t best = scan.order[0];
  return {*scan.scan, fit.variances, sizes_beside(data, fit, scan.candidates[best], scan.fits[best]),
          settings, static_cast<std::uint64_t>(what) + ++asked_};
}

}  // namespace tunnelrig
