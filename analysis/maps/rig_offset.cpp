#include "analysis/maps/rig_offset.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::vector<Index> on_centre_line(const FieldData& data) {
  std::vector<Index> rows;
  for (Index i = 0; i < data.size(); ++i) {
    if (data.points[static_cast<std::size_t>(i)].y_norm == 0) rows.push_back(i);
  }
  return rows;
}

}  // namespace

VectorXd column_of_offset(const FieldData& data) {
  if (data.offset_column(on_centre_line(data)).any()) return data.offset_column;
  return VectorXd::Zero(data.size());
}

OffsetWeights offset_weights(const Eigen::LLT<MatrixXd>& factor, const VectorXd& column) {
  if (!column.any()) return {VectorXd::Zero(column.size())};
  const VectorXd solved = factor.solve(column);
  const double variance = 1 / column.dot(solved);
  return {variance * solved, variance};
}

MatrixXd without_offset(const MatrixXd& inverse, const OffsetWeights& offset) {
  if (offset.variance == 0) return inverse;
  return inverse - offset.weights * offset.weights.transpose() / offset.variance;
}

std::optional<FieldEstimate> estimate_of(const OffsetWeights& offset, const FieldData& data) {
  if (!offset.weights.any()) return {};
  return FieldEstimate{offset.weights.dot(data.values), std::sqrt(offset.variance),
                       effective_dof(data.over_root_dof, offset.weights, offset.variance)};
}

std::vector<MeasuredField> less_offset(const OffsetWeights& offset, const FieldData& data) {
  const VectorXd column = column_of_offset(data);
  std::vector<MeasuredField> measured;
  for (Index i = 0; i < data.size(); ++i) {
    const TunnelPoint& point = data.points[static_cast<std::size_t>(i)];
    if (point.y_norm == 0) continue;
    const VectorXd weights = VectorXd::Unit(data.size(), i) - column(i) * offset.weights;
    const double variance =
        std::max(0.0, data.covariance(i, i) - 2 * column(i) * data.covariance.row(i).dot(offset.weights) +
                          column(i) * column(i) * offset.variance);
    measured.push_back(
        {.label = data.labels[static_cast<std::size_t>(i)],
         .point = point,
         .field = {weights.dot(data.values),
                   data.scatter_known ? std::sqrt(variance) : std::numeric_limits<double>::quiet_NaN(),
                   effective_dof(data.over_root_dof, weights, variance)}});
  }
  return measured;
}

OffsetWeights offset_weights_on_centre_line(const FieldData& data) {
  OffsetWeights result{VectorXd::Zero(data.size())};
  const std::vector<Index> rows = on_centre_line(data);
  if (rows.empty()) return result;
  const MatrixXd measured = data.covariance(rows, rows);
  // So that exact measurements, which then count alike, and shared errors leave a matrix that can be
  // inverted.
  const MatrixXd slack = 1e-8 * std::max(measured.cwiseAbs().maxCoeff(), 1e-6) *
                         MatrixXd::Identity(measured.rows(), measured.cols());
  const OffsetWeights there =
      offset_weights(Eigen::LLT<MatrixXd>(measured + slack), column_of_offset(data)(rows));
  result.weights(rows) = there.weights;
  result.variance = std::max(0.0, there.weights.dot(measured * there.weights));
  return result;
}

}  // namespace tunnelrig
