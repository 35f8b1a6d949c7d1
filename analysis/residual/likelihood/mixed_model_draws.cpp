// Data sets without any effect, drawn from the model.
#include "analysis/residual/likelihood/mixed_model.h"

#include <cmath>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

Stacked MixedModel::simulate(std::size_t stratum, const std::vector<double>& sigma,
                             const std::vector<std::size_t>& ratio, double run_correlation,
                             std::mt19937_64& random, const MatrixXd& sizes) const {
  std::normal_distribution<double> normal;
  const Index n = static_cast<Index>(rows_.size());
  const double fresh = std::sqrt(1 - run_correlation * run_correlation);
  const bool signs = sizes.size() > 0;
  MatrixXd own = signs ? sizes : MatrixXd::Ones(n, strata_[stratum].modes);  // scatter, over σ
  own.array().colwise() *= run_scatter(stratum).array();
  Stacked result(own.size(), static_cast<Index>(sigma.size()));
  for (Index i = 0; i < result.cols(); ++i) {
    for (Index k = 0; k < result.rows(); ++k)
      result(k, i) = signs ? std::copysign(1.0, normal(random)) : normal(random);
    Eigen::Map<MatrixXd> modes(result.col(i).data(), n, strata_[stratum].modes);
    const double session = std::sqrt(kRatios[ratio[static_cast<std::size_t>(i)]]);
    for (Index mode = 0; mode < modes.cols(); ++mode) {
      for (const auto& runs : blocks_) {
        for (std::size_t k = 1; k < runs.size() && run_correlation != 0; ++k)
          modes(runs[k], mode) = run_correlation * modes(runs[k - 1], mode) + fresh * modes(runs[k], mode);
        const double offset = session * normal(random);
        for (const Index run : runs) modes(run, mode) = own(run, mode) * modes(run, mode) + offset;
      }
    }
    result.col(i) *= sigma[static_cast<std::size_t>(i)];
  }
  return result;
}

Stacked MixedModel::simulate_unit(std::size_t stratum, std::size_t ratio, std::size_t sets,
                                  double run_correlation, std::mt19937_64& random) const {
  return simulate(stratum, std::vector<double>(sets, 1.0), std::vector<std::size_t>(sets, ratio),
                  run_correlation, random);
}

}  // namespace tunnelrig
