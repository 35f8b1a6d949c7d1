// What the blocks of a model are to its baseline.
#include "analysis/residual/likelihood/mixed_model.h"

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd MixedModel::block_squares(std::size_t stratum) const {
  if (strata_[stratum].means()) return block_squares_[prepared_side(stratum)];
  VectorXd result(static_cast<Index>(blocks_.size()));
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    result(static_cast<Index>(b)) = static_cast<double>(blocks_[b].size());
  return result;
}

MatrixXd MixedModel::block_products(std::size_t stratum) const {
  MatrixXd result = block_squares(stratum).asDiagonal();
  if (!strata_[stratum].means()) return result;
  const Eigen::SparseMatrix<double>& with_blocks = with_blocks_[prepared_side(stratum)];
  const auto& normal = prepared(stratum, 0).normal;
  const MatrixXd dense = with_blocks;
  result -= with_blocks.transpose() * (normal ? normal->solve(dense) : dense);
  return result;
}

MatrixXd MixedModel::solve_blocks(std::size_t stratum, std::size_t ratio,
                                  const Eigen::Ref<const MatrixXd>& columns) const {
  if (kRatios[ratio] == 0) return columns;
  if (strata_[stratum].means()) return prepared(stratum, ratio).normal->solve_blocks(columns);
  const VectorXd inverse = (1 + kRatios[ratio] * block_squares(stratum).array()).inverse();
  return inverse.asDiagonal() * columns;
}

}  // namespace tunnelrig
