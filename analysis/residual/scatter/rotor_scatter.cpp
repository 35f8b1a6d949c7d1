#include "analysis/residual/scatter/rotor_scatter.h"

#include "analysis/residual/scatter/alike.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Variance of what each rotor's runs have of their own, whatever they have in common; those of `alike` share
/// one. A rotor's distance from the mean of all, weighted by 1/v_i, has the variance v_i − 1/Σ(1/v), v_i the
/// rotor's own: a fixed point.
VectorXd own_variances(const MatrixXd& rotors, const std::vector<Index>& alike) {
  constexpr int kIterations = 30;
  constexpr double kLeast = 0.05;  // of the second smallest: a single rotor's may be estimated as none
  VectorXd variance = VectorXd::Ones(rotors.cols());
  for (int i = 0; i < kIterations; ++i) {
    const VectorXd weight = variance.cwiseInverse();
    const VectorXd mean = rotors * weight / weight.sum();
    const VectorXd size = (rotors.colwise() - mean).cwiseAbs().colwise().mean();
    variance = std::numbers::pi / 2 * size.array().square() + (i == 0 ? 0 : 1 / weight.sum());
    if (!alike.empty()) variance(alike).setConstant(VectorXd(variance(alike)).mean());
    VectorXd sorted = variance;
    std::nth_element(sorted.begin(), sorted.begin() + 1, sorted.end());
    variance = variance.cwiseMax(kLeast * sorted[1]);
  }
  return variance;
}

/// ln of each rotor's own variance over that of those it is taken to be like.
VectorXd unlikeness(const MatrixXd& rotors, const std::vector<Index>& alike) {
  const VectorXd log = own_variances(rotors, {}).array().log();
  return VectorXd(log(alike)).array() - VectorXd(log(alike)).mean();
}

/// A data set of the stratum as residuals of the rotors but for what they have in common.
MatrixXd differences(const MixedModel& model, std::size_t stratum, std::size_t ratio, Stacked column) {
  model.project(stratum, ratio, column);
  const Index modes = model.strata()[stratum].modes;
  return by_mode(column, modes) * model.rotors_of_modes().bottomRows(modes);
}

}  // namespace

VectorXd rotor_scatter(const Observations& observations, const std::vector<int>& rows,
                       const Components& residual, std::mt19937_64& random) {
  Observations seen = observations;
  seen.scatter = {.by_condition = observations.scatter.by_condition};
  std::vector<Index> alike(static_cast<std::size_t>(observations.channels()));
  std::iota(alike.begin(), alike.end(), Index{0});
  while (alike.size() >= kFewestToCompare) {
    const MixedModel model(seen, rows);
    const NullFit fit = CandidateScan(model, {}, {}).null_fit(residual);
    const std::size_t s = model.differences(), ratio = fit.ratio[s];
    const MatrixXd rotors = differences(model, s, ratio, model.stack(s, {&residual}));
    Index most = 0;
    const double unlike = unlikeness(rotors, alike).cwiseAbs().maxCoeff(&most);
    const Stacked sets = model.simulate_unit(s, ratio, kAlikeSets, 0, random);
    bool by_chance = false;
    for (Index i = 0; i < sets.cols() && !by_chance; ++i)
      by_chance =
          unlikeness(differences(model, s, ratio, sets.col(i)), alike).cwiseAbs().maxCoeff() >= unlike;
    if (by_chance) break;
    alike.erase(alike.begin() + most);
    const VectorXd log = own_variances(rotors, alike).array().log();
    seen.scatter.rotors = ((log.array() - log.mean()) / 2).exp();
  }
  return seen.scatter.rotors;
}

}  // namespace tunnelrig
