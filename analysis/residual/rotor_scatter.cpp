#include "analysis/residual/rotor_scatter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kAlikeSets = 200;
constexpr Index kFewestToCompare = 3;  // of two, nothing says which of them scatters

/// Variance of what each rotor's runs have of their own, whatever they have in common; those of `alike` share
/// one. A rotor's distance from the mean of all, weighted by 1/d_i, has the variance d_i − 1/Σ(1/d): a fixed
/// point.
VectorXd own_variances(const MatrixXd& rotors, const std::vector<Index>& alike) {
  constexpr int kIterations = 30;
  constexpr double kLeast = 0.05;  // of the mean: a single rotor's may be estimated as none
  VectorXd variance = VectorXd::Ones(rotors.cols());
  for (int i = 0; i < kIterations; ++i) {
    const VectorXd weight = variance.cwiseInverse();
    const VectorXd mean = rotors * weight / weight.sum();
    const VectorXd size = (rotors.colwise() - mean).cwiseAbs().colwise().mean();
    variance = std::numbers::pi / 2 * size.array().square() + (i == 0 ? 0 : 1 / weight.sum());
    if (!alike.empty()) variance(alike).setConstant(VectorXd(variance(alike)).mean());
    variance = variance.cwiseMax(kLeast * variance.mean());
  }
  return variance;
}

/// ln of each rotor's own variance over that of those it is taken to be like.
VectorXd unlikeness(const MatrixXd& rotors, const std::vector<Index>& alike) {
  const VectorXd log = own_variances(rotors, {}).array().log();
  return VectorXd(log(alike)).array() - VectorXd(log(alike)).mean();
}

/// Residuals of the rotors but for what they have in common, one matrix per data set.
class Differences {
 public:
  Differences(const MixedModel& model, const NullFit& fit) : model_(model), fit_(fit) {
    while (!model.strata()[stratum_].means() || model.strata()[stratum_].side() == 0) ++stratum_;
  }
  MatrixXd of(const Components& residual) const { return rotors(model_.stack(stratum_, {&residual})); }
  std::vector<MatrixXd> simulated(std::mt19937_64& random) const {
    Stacked drawn = model_.simulate(stratum_, std::vector<double>(kAlikeSets, 1.0),
                                    std::vector<std::size_t>(kAlikeSets, fit_.ratio[stratum_]), 0, random);
    std::vector<MatrixXd> result;
    for (Index set = 0; set < drawn.cols(); ++set) result.push_back(rotors(drawn.col(set)));
    return result;
  }

 private:
  MatrixXd rotors(Stacked column) const {
    model_.project(stratum_, fit_.ratio[stratum_], column);
    const Index modes = model_.strata()[stratum_].modes;
    return Eigen::Map<const MatrixXd>(column.data(), column.size() / modes, modes) *
           model_.rotors_of_modes().bottomRows(modes);
  }

  const MixedModel& model_;
  const NullFit& fit_;
  std::size_t stratum_ = 0;
};

}  // namespace

VectorXd rotor_scatter(const Observations& observations, const std::vector<int>& rows,
                       const Components& residual, std::mt19937_64& random) {
  Observations seen = observations;
  seen.rotor_scatter.resize(0);
  seen.run_correlation = {0, 0};
  std::vector<Index> alike(static_cast<std::size_t>(observations.channels()));
  std::iota(alike.begin(), alike.end(), Index{0});
  while (static_cast<Index>(alike.size()) >= kFewestToCompare) {
    const MixedModel model(seen, rows);
    const NullFit fit = CandidateScan(model, {}, {}).null_fit(residual);
    const Differences differences(model, fit);
    const MatrixXd rotors = differences.of(residual);
    Index most = 0;
    const double unlike = unlikeness(rotors, alike).cwiseAbs().maxCoeff(&most);
    const std::vector<MatrixXd> simulated = differences.simulated(random);
    if (std::any_of(simulated.begin(), simulated.end(), [&](const MatrixXd& set) {
          return unlikeness(set, alike).cwiseAbs().maxCoeff() >= unlike;
        }))
      break;
    alike.erase(alike.begin() + most);
    const VectorXd log = own_variances(rotors, alike).array().log();
    seen.rotor_scatter = ((log.array() - log.mean()) / 2).exp();
  }
  return seen.rotor_scatter;
}

}  // namespace tunnelrig
