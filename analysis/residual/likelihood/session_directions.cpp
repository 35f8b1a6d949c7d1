#include "analysis/residual/likelihood/session_directions.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

SessionDirections::SessionDirections(const MixedModel& model, std::size_t stratum)
    : modes_(model.strata()[stratum].modes), blocks_(model.blocks()) {
  constexpr double kNothing = 1e-12;  // of the largest: sessions that the baseline absorbs
  constexpr Index kAtATime = 64;      // indicators, which are dense once they are projected
  if (model.ratios() == 1) {
    blocks_.clear();
    return;
  }
  MatrixXd ones = MatrixXd::Ones(static_cast<Index>(model.rows().size()), 1);
  whiten(blocks_, model.run_scatter(stratum), 0, model.run_correlation(stratum), ones);
  of_blocks_ = ones;
  const auto blocks = static_cast<Index>(blocks_.size());
  MatrixXd products(blocks, blocks);
  for (Index first = 0; first < blocks; first += kAtATime) {
    const Index some = std::min(kAtATime, blocks - first);
    Stacked indicators = Stacked::Zero(of_blocks_.size(), some);
    for (Index b = 0; b < some; ++b) indicators(blocks_[static_cast<std::size_t>(first + b)], b).setOnes();
    model.project(stratum, 0, indicators);
    products.middleCols(first, some) = in_blocks(indicators);
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver((products + products.transpose()) / 2);
  const Eigen::VectorXd& lambda = solver.eigenvalues();  // increasing
  const Index kept = (lambda.array() > kNothing * lambda.maxCoeff()).count();
  lambda_ = lambda.tail(kept);
  directions_ = solver.eigenvectors().rightCols(kept) * lambda_.cwiseSqrt().cwiseInverse().asDiagonal();
}

MatrixXd SessionDirections::in_blocks(const Eigen::Ref<const MatrixXd>& columns) const {
  MatrixXd result(static_cast<Index>(blocks_.size()), columns.cols());
  for (Index c = 0; c < columns.cols(); ++c)
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      double sum = 0;
      for (const Index run : blocks_[b]) sum += of_blocks_(run) * columns(run, c);
      result(static_cast<Index>(b), c) = sum;
    }
  return result;
}

Stacked SessionDirections::coordinates(const Stacked& projected) const {
  Stacked result(directions_.cols() * modes_, projected.cols());
  if (result.size() == 0) return result;
  const Eigen::Map<const MatrixXd> by_mode(projected.data(), of_blocks_.size(), modes_ * projected.cols());
  Eigen::Map<MatrixXd>(result.data(), directions_.cols(), by_mode.cols()).noalias() =
      directions_.transpose() * in_blocks(by_mode);
  return result;
}

Eigen::VectorXd SessionDirections::weights(double session_ratio) const {
  const Eigen::ArrayXd scaled = session_ratio * lambda_.array();
  return (scaled / (1 + scaled)).matrix().replicate(modes_, 1);
}

}  // namespace tunnelrig
