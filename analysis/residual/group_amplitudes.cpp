#include "analysis/residual/group_amplitudes.h"

#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kLeastSeen = 1e-6;  // of a column: below it what is left is rounding

}  // namespace

std::vector<GroupEstimate> estimate_by_group(const Observations& observations, const MeanModel& model,
                                             std::size_t t, const NullFit& variances,
                                             const std::vector<int>& rows) {
  const auto own_amplitudes = [&](std::size_t end) {
    return std::count_if(model.terms.begin(), model.terms.begin() + static_cast<std::ptrdiff_t>(end),
                         [](const Term& term) { return term.per_group; });
  };
  // Effects of each group's own are the last of the baseline's slopes, in their order.
  const Index column = observations.slopes.cols() - own_amplitudes(model.terms.size()) + own_amplitudes(t);
  const Components offset = linearise(observations, model, predict_forces(observations, model, rows)).offset;
  std::vector<GroupEstimate> result;
  for (const auto& [group, own] : rows_of_each(observations.group, rows)) {
    const Index n = static_cast<Index>(own.size()), k = observations.slopes.cols();
    MatrixXd items(n, k + 2);  // constant and other columns, then x and y
    items << VectorXd::Ones(n), observations.slopes(own, Eigen::all),
        observations.y(own, 0) - offset[0](own, 0);
    items.col(1 + column).swap(items.col(k));
    whiten(without_numbers(places_of_each(observations.block, own)), observations.scatter.of_runs(own),
           kRatios[variances.ratio[0]], 0, items);
    // What the group's other columns make of both is no part of the amplitude (Frisch & Waugh 1933).
    const MatrixXd others = items.leftCols(k);
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(others);
    const MatrixXd left = items.rightCols(2) - others * solver.solve(items.rightCols(2));
    const VectorXd seen = left.col(0), rest = left.col(1);
    const Index dof = n - 1 - solver.rank();
    if (dof < 1 || !(seen.norm() > kLeastSeen * items.col(k).norm())) continue;
    const double amplitude = seen.dot(rest) / seen.squaredNorm();
    const double variance = (rest - amplitude * seen).squaredNorm() / static_cast<double>(dof);
    const double half =
        student_t_quantile(0.975, static_cast<double>(dof)) * std::sqrt(variance / seen.squaredNorm());
    result.push_back({observations.group_name[static_cast<std::size_t>(group)], amplitude, amplitude - half,
                      amplitude + half});
  }
  return result;
}

}  // namespace tunnelrig
