#include "analysis/residual/observations/previous_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// In the scale of y.
MatrixXd scaled(const Observations& observations, const MatrixXd& predicted) {
  const MatrixXd over_known = predicted.cwiseQuotient(observations.known);
  return observations.multiplicative ? MatrixXd(over_known.array().log()) : over_known;
}

bool in_one_group(const Observations& observations, Index row, int other) {
  return observations.group[static_cast<std::size_t>(row)] ==
         observations.group[static_cast<std::size_t>(other)];
}

}  // namespace

MatrixXd variance_of_constants(const Observations& observations, const MatrixXd& predicted) {
  MatrixXd left = observations.y - scaled(observations, predicted);
  VectorXd count = VectorXd::Zero(observations.groups());
  for (Index row = 0; row < observations.rows(); ++row)
    if (observations.has_response(row)) count(observations.group[static_cast<std::size_t>(row)]) += 1;
  if (observations.line_of_cell) {  // its force has no zero, which is no scatter
    const MatrixXd seen = left.array().isNaN().select(0, left);
    MatrixXd sum = MatrixXd::Zero(observations.groups(), left.cols());
    for (Index row = 0; row < left.rows(); ++row)
      sum.row(observations.group[static_cast<std::size_t>(row)]) += seen.row(row);
    for (Index row = 0; row < left.rows(); ++row) {
      const Index group = observations.group[static_cast<std::size_t>(row)];
      left.row(row) -= sum.row(group) / std::max(count(group), 1.0);
    }
  }
  const double free = count.sum() - static_cast<double>((count.array() > 0).count());
  const Eigen::RowVectorXd variance =
      left.array().isNaN().select(0, left).colwise().squaredNorm() / std::max(free, 1.0);
  return count(observations.group).cwiseMax(1).cwiseInverse() * variance;
}

PreviousRun::PreviousRun(const Observations& observations, const MatrixXd& predicted)
    : observations_(observations),
      predicted_(predicted),
      constant_variance_(variance_of_constants(observations, predicted)) {}

double PreviousRun::force_of(Index row, Index channel) const {
  return observations_.signed_force_N(predicted_(row, channel), row);
}

double PreviousRun::force_N(Index row, Index channel) const {
  constexpr double kSame = 0.01;
  const int before = observations_.previous[static_cast<std::size_t>(row)];
  if (before < 0) return std::numeric_limits<double>::quiet_NaN();
  const double own = force_of(row, channel), previous = force_of(before, channel);
  const bool same =
      in_one_group(observations_, row, before) && std::abs(previous - own) < kSame * std::abs(own);
  return same ? own : previous;
}

double PreviousRun::error_N(Index row, Index channel) const {
  const int before = observations_.previous[static_cast<std::size_t>(row)];
  if (before < 0 || in_one_group(observations_, row, before)) return 0;
  const double error = std::sqrt(constant_variance_(row, channel) + constant_variance_(before, channel));
  return error * (observations_.multiplicative ? std::abs(force_of(row, channel))
                                               : std::abs(observations_.known(row, channel)));
}

}  // namespace tunnelrig
