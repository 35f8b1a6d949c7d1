#include "analysis/residual/likelihood/baseline_normal.h"

#include <cmath>
#include <limits>

#include <Eigen/SparseCholesky>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

struct BaselineNormal::Factor {
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> cholesky;
};

BaselineNormal::BaselineNormal(const NormalParts& parts, double session_ratio)
    : factor_(std::make_unique<Factor>()), columns_(parts.columns) {
  const Index all = columns_ + parts.blocks.size();
  std::vector<Eigen::Triplet<double>> entries = parts.independent;
  entries.reserve(parts.independent.size() + parts.of_blocks.size() +
                  static_cast<std::size_t>(parts.blocks.size()));
  for (const auto& entry : parts.of_blocks)  // the lower triangle alone is read
    entries.emplace_back(columns_ + entry.col(), entry.row(), std::sqrt(session_ratio) * entry.value());
  for (Index b = 0; b < parts.blocks.size(); ++b) {
    const double own = 1 + session_ratio * parts.blocks(b);
    entries.emplace_back(columns_ + b, columns_ + b, own);
    log_determinant_ -= std::log(own);
  }
  Eigen::SparseMatrix<double> equations(all, all);
  equations.setFromTriplets(entries.begin(), entries.end());
  factor_->cholesky.compute(equations);
  if (factor_->cholesky.info() != Eigen::Success) log_determinant_ = std::numeric_limits<double>::quiet_NaN();
  log_determinant_ += 2 * factor_->cholesky.matrixL().nestedExpression().diagonal().array().log().sum();
}

BaselineNormal::BaselineNormal(BaselineNormal&&) noexcept = default;
BaselineNormal& BaselineNormal::operator=(BaselineNormal&&) noexcept = default;
BaselineNormal::~BaselineNormal() = default;

/// Of the inverse, the block of the rows and columns from `first` on that `right` has.
MatrixXd BaselineNormal::solve_rows(Index first, const Eigen::Ref<const MatrixXd>& right) const {
  if (factor_->cholesky.info() != Eigen::Success)  // of what is no number
    return MatrixXd::Constant(right.rows(), right.cols(), std::numeric_limits<double>::quiet_NaN());
  MatrixXd whole = MatrixXd::Zero(factor_->cholesky.rows(), right.cols());
  whole.middleRows(first, right.rows()) = right;
  return MatrixXd(factor_->cholesky.solve(whole)).middleRows(first, right.rows());
}

MatrixXd BaselineNormal::solve(const Eigen::Ref<const MatrixXd>& right) const { return solve_rows(0, right); }

MatrixXd BaselineNormal::solve_blocks(const Eigen::Ref<const MatrixXd>& right) const {
  return solve_rows(columns_, right);
}

MatrixXd BaselineNormal::inverse_columns(Index first, Index count) const {
  MatrixXd right = MatrixXd::Zero(columns_, count);
  right.middleRows(first, count).setIdentity();
  return solve(right);
}

}  // namespace tunnelrig
