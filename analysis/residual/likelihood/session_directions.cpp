#include "analysis/residual/likelihood/session_directions.h"

#include <Eigen/Eigenvalues>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

SessionDirections::SessionDirections(const MixedModel& model, std::size_t stratum)
    : modes_(model.strata()[stratum].modes) {
  constexpr double kNothing = 1e-12;  // of the largest: sessions that the baseline absorbs
  const Index runs = static_cast<Index>(model.rows().size());
  if (model.ratios() == 1) {
    directions_.resize(runs, 0);
    return;
  }
  Stacked indicators = Stacked::Zero(runs * modes_, static_cast<Index>(model.blocks().size()));
  for (std::size_t b = 0; b < model.blocks().size(); ++b)
    for (const Index run : model.blocks()[b]) indicators(run, static_cast<Index>(b)) = 1;
  model.project(stratum, 0, indicators);
  const MatrixXd z = indicators.topRows(runs);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(z.transpose() * z);
  const Eigen::VectorXd& lambda = solver.eigenvalues();  // increasing
  const Index kept = (lambda.array() > kNothing * lambda.maxCoeff()).count();
  lambda_ = lambda.tail(kept);
  directions_ = z * solver.eigenvectors().rightCols(kept) * lambda_.cwiseSqrt().cwiseInverse().asDiagonal();
}

Stacked SessionDirections::coordinates(const Stacked& projected) const {
  Stacked result(directions_.cols() * modes_, projected.cols());
  if (result.size() == 0) return result;
  const Eigen::Map<const MatrixXd> by_mode(projected.data(), directions_.rows(), modes_ * projected.cols());
  Eigen::Map<MatrixXd>(result.data(), directions_.cols(), by_mode.cols()).noalias() =
      directions_.transpose() * by_mode;
  return result;
}

Eigen::VectorXd SessionDirections::weights(double session_ratio) const {
  const Eigen::ArrayXd scaled = session_ratio * lambda_.array();
  return (scaled / (1 + scaled)).matrix().replicate(modes_, 1);
}

}  // namespace tunnelrig
