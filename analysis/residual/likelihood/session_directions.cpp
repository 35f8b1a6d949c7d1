#include "analysis/residual/likelihood/session_directions.h"

#include <Eigen/Eigenvalues>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

SessionDirections::SessionDirections(const MixedModel& model, std::size_t stratum, Index most_blocks)
    : model_(&model),
      stratum_(stratum),
      modes_(model.strata()[stratum].modes),
      // Of a run's course, which has no baseline, the products are a diagonal as they are.
      few_(model.strata()[stratum].means() && std::ssize(model.blocks()) <= most_blocks) {
  constexpr double kNothing = 1e-12;  // of a block's squares
  if (model.ratios() == 1) return;
  count_ = std::ssize(model.blocks());
  MatrixXd ones = MatrixXd::Ones(std::ssize(model.rows()), 1);
  whiten(model.blocks(), model.run_scatter(stratum), 0, model.run_correlation(stratum), ones);
  of_blocks_ = ones;
  if (!few_) return;
  const MatrixXd products = model.block_products(stratum);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver((products + products.transpose()) / 2);
  // increasing, the least those of sessions that the baseline absorbs: rounding, which may be below 0
  const Eigen::VectorXd& lambda = solver.eigenvalues();
  count_ = (lambda.array() > kNothing * model.block_squares(stratum).maxCoeff()).count();
  lambda_ = lambda.tail(count_);
  directions_ = solver.eigenvectors().rightCols(count_);
}

MatrixXd SessionDirections::in_blocks(const Eigen::Ref<const MatrixXd>& columns) const {
  const std::vector<std::vector<Index>>& blocks = model_->blocks();
  MatrixXd result(std::ssize(blocks), columns.cols());
  for (Index c = 0; c < columns.cols(); ++c)
    for (Index b = 0; b < result.rows(); ++b) {
      double sum = 0;
      for (const Index run : blocks[static_cast<std::size_t>(b)]) sum += of_blocks_(run) * columns(run, c);
      result(b, c) = sum;
    }
  return result;
}

Stacked SessionDirections::coordinates(const Stacked& projected) const {
  Stacked result(count_ * modes_, projected.cols());
  if (result.size() == 0) return result;
  const Eigen::Map<const MatrixXd> by_mode(projected.data(), of_blocks_.size(), modes_ * projected.cols());
  Eigen::Map<MatrixXd> by_block(result.data(), count_, by_mode.cols());
  if (few_)
    by_block.noalias() = directions_.transpose() * in_blocks(by_mode);
  else
    by_block = in_blocks(by_mode);
  return result;
}

Stacked SessionDirections::weighted(std::size_t ratio, const Stacked& coordinates) const {
  if (coordinates.size() == 0) return coordinates;
  const double a = kRatios[ratio];
  const Eigen::Map<const MatrixXd> by_block(coordinates.data(), count_, coordinates.size() / count_);
  Stacked result(coordinates.rows(), coordinates.cols());
  Eigen::Map<MatrixXd> weighted(result.data(), by_block.rows(), by_block.cols());
  if (few_)
    weighted = (a / (1 + a * lambda_.array())).matrix().asDiagonal() * by_block;
  else
    weighted = a * model_->solve_blocks(stratum_, ratio, by_block);
  return result;
}

}  // namespace tunnelrig
