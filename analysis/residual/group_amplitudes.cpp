#include "analysis/residual/group_amplitudes.h"

#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kLeastSeen = 1e-6;  // of a column: below it what is left is rounding

}  // namespace

std::vector<GroupEstimate> estimate_by_group(const Observations& observations, const MeanModel& model,
                                             std::size_t t, const std::vector<int>& rows) {
  const auto own_amplitudes = [&](std::size_t end) {
    return std::count_if(model.terms.begin(), model.terms.begin() + static_cast<std::ptrdiff_t>(end),
                         [](const Term& term) { return term.per_group; });
  };
  // Effects of each group's own are the last of the baseline's slopes, in their order.
  const Index column = observations.slopes.cols() - own_amplitudes(model.terms.size()) + own_amplitudes(t);
  const Components offset = linearise(observations, model, predict_forces(observations, model, rows)).offset;
  std::map<int, std::vector<int>> groups;
  for (const int row : rows) groups[observations.group[static_cast<std::size_t>(row)]].push_back(row);
  std::vector<GroupEstimate> result;
  for (const auto& [group, own] : groups) {
    const VectorXd response = VectorXd(observations.y(own, 0)) - VectorXd(offset[0](own, 0));
    const MatrixXd slopes = observations.slopes(own, Eigen::all);
    const MatrixXd x = slopes.rowwise() - slopes.colwise().mean();
    const VectorXd y = response.array() - response.mean();
    MatrixXd others = x;
    others.col(column).setZero();
    // What the group's other columns make of both is no part of the amplitude (Frisch & Waugh 1933).
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(others);
    const VectorXd seen = x.col(column) - others * solver.solve(x.col(column));
    const VectorXd rest = y - others * solver.solve(y);
    const Index dof = y.size() - 2 - solver.rank();
    if (dof < 1 || !(seen.norm() > kLeastSeen * x.col(column).norm())) continue;
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
