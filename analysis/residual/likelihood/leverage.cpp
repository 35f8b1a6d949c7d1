// How far each run is from what all others say of it: residuals over 1 − h, h the run's leverage.
#include "analysis/residual/likelihood/mixed_model.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/QR>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd MixedModel::baseline_leverage(std::size_t stratum, std::size_t ratio) const {
  if (!strata_[stratum].means()) return VectorXd::Zero(static_cast<Index>(rows_.size()));
  const auto& normal = prepared(stratum, ratio).normal;
  if (!normal) return own_.rowwise().squaredNorm();
  const MatrixXd covariance = normal->inverse_columns(0, columns_);
  VectorXd result(static_cast<Index>(rows_.size()));
  for (const std::vector<Index>& runs : blocks_) {
    std::vector<Index> used;  // columns of the groups that this block has
    for (const Index run : runs)
      for (Index k = 0; k < own_.cols(); ++k)
        used.push_back(first_column_[static_cast<std::size_t>(run)] + k);
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    MatrixXd whitened = MatrixXd::Zero(static_cast<Index>(runs.size()), static_cast<Index>(used.size()));
    for (std::size_t m = 0; m < runs.size(); ++m) {
      const auto first =
          std::lower_bound(used.begin(), used.end(), first_column_[static_cast<std::size_t>(runs[m])]);
      whitened.row(static_cast<Index>(m)).segment(first - used.begin(), own_.cols()) = own_.row(runs[m]);
    }
    std::vector<Index> places(runs.size());
    std::iota(places.begin(), places.end(), 0);
    whiten({places}, run_scatter(stratum)(runs), kRatios[ratio], run_correlation(stratum), whitened);
    result(runs) = (whitened * covariance(used, used)).cwiseProduct(whitened).rowwise().sum();
  }
  return result;
}

std::vector<MatrixXd> MixedModel::sizes_left(const std::vector<std::size_t>& ratio,
                                             const std::vector<double>& sigma, const Components& y,
                                             const std::vector<Components>& columns,
                                             const VectorXd& amplitude,
                                             const std::vector<Index>& as_they_are) const {
  constexpr double kLeastLeft = 1e-6;  // of the only run at a location nothing is: what there is, is rounding
  constexpr double kMostTaken = 0.9;
  const Index n = static_cast<Index>(rows_.size()), count = static_cast<Index>(columns.size());
  const std::vector<const Components*> items = pointers_to(columns);
  std::vector<Stacked> projected(strata_.size());
  MatrixXd information = MatrixXd::Zero(count, count);
  for (std::size_t s = 0; s < strata_.size(); ++s) {
    projected[s] = stack(s, items) / sigma[s];
    project(s, ratio[s], projected[s]);
    information += projected[s].transpose() * projected[s];
  }
  const MatrixXd covariance = information.completeOrthogonalDecomposition().pseudoInverse();
  std::vector<MatrixXd> result(strata_.size());
  for (std::size_t s = 0; s < strata_.size(); ++s) {
    if (!strata_[s].means()) continue;
    Stacked of_baseline = stack(s, {&y});
    project(s, ratio[s], of_baseline);
    const VectorXd left = of_baseline.col(0) - sigma[s] * (projected[s] * amplitude);
    const VectorXd own = (1 - baseline_leverage(s, ratio[s]).array()).matrix().replicate(strata_[s].modes, 1);
    const VectorXd taken = (projected[s] * covariance).cwiseProduct(projected[s]).rowwise().sum();
    VectorXd size(left.size());
    for (Index i = 0; i < size.size(); ++i) {
      const bool as_is = std::find(as_they_are.begin(), as_they_are.end(), i % n) != as_they_are.end();
      size(i) = own(i) < kLeastLeft              ? 0
                : as_is                          ? std::abs(left(i))
                : taken(i) > kMostTaken * own(i) ? std::abs(of_baseline(i)) / own(i)
                                                 : std::abs(left(i)) / (own(i) - taken(i));
    }
    result[s] = Eigen::Map<const MatrixXd>(size.data(), n, strata_[s].modes);
    if (size.norm() > 0) result[s] *= std::sqrt(static_cast<double>(size.size())) / size.norm();
  }
  return result;
}

}  // namespace tunnelrig
