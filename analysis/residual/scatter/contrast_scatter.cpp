#include "analysis/residual/scatter/contrast_scatter.h"

#include "analysis/residual/scatter/alike.h"

#include <cmath>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// ln of each contrast's mean absolute value, over their geometric mean: of a data set of the stratum, which
/// a single wild run does not decide.
VectorXd unlikeness(const MixedModel& model, std::size_t stratum, std::size_t ratio, Stacked column) {
  model.project(stratum, ratio, column);
  const VectorXd log =
      by_mode(column, model.strata()[stratum].modes).cwiseAbs().colwise().mean().array().log();
  return log.array() - log.mean();
}

}  // namespace

VectorXd contrast_scatter(const Observations& observations, const std::vector<int>& rows,
                          const Components& residual, std::mt19937_64& random) {
  constexpr Index kRotors = 4;  // of others the contrasts mean nothing
  if (observations.channels() != kRotors) return {};
  Observations seen = observations;
  seen.scatter = {.by_condition = observations.scatter.by_condition};
  const MixedModel model(seen, rows);
  const std::size_t s = model.differences();
  const std::size_t ratio = CandidateScan(model, {}, {}).null_fit(residual).ratio[s];
  const VectorXd seen_here = unlikeness(model, s, ratio, model.stack(s, {&residual}));
  if (!seen_here.allFinite()) return {};  // nothing is left of one
  const double most = seen_here.cwiseAbs().maxCoeff();
  const Stacked sets = model.simulate_unit(s, ratio, kAlikeSets, 0, random);
  for (Index i = 0; i < sets.cols(); ++i)
    if (unlikeness(model, s, ratio, sets.col(i)).cwiseAbs().maxCoeff() >= most) return {};
  return seen_here.array().exp();
}

}  // namespace tunnelrig
