#include "analysis/residual/scatter/run_correlation.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tunnelrig {
namespace {

using Eigen::Index;

constexpr std::size_t kSimulated = 100;
constexpr double kKnown = 0.5;  // correlation of the second simulation
constexpr double kMostCorrelated = 0.9;

/// Σ e_i e_{i+1} / Σ e_i² over neighbours within blocks, one per column.
Eigen::VectorXd of_neighbours(const MixedModel& model, std::size_t stratum, const Stacked& columns) {
  const auto n = static_cast<Index>(model.rows().size());
  Eigen::VectorXd result(columns.cols());
  for (Index i = 0; i < columns.cols(); ++i) {
    const Eigen::Map<const Eigen::MatrixXd> modes(columns.col(i).data(), n, model.strata()[stratum].modes);
    double products = 0;
    for (const auto& runs : model.blocks())
      for (std::size_t k = 1; k < runs.size(); ++k)
        products += modes.row(runs[k]).dot(modes.row(runs[k - 1]));
    result(i) = products / std::max(columns.col(i).squaredNorm(), 1e-300);
  }
  return result;
}

struct Spread {
  double mean, deviation;
};

Spread simulated(const MixedModel& model, const NullFit& fit, std::size_t stratum, double correlation,
                 std::mt19937_64& random) {
  const std::size_t ratio = fit.ratio[stratum];
  Stacked data = model.simulate_unit(stratum, ratio, kSimulated, correlation, random);
  model.project(stratum, ratio, data);
  const Eigen::VectorXd seen = of_neighbours(model, stratum, data);
  return {seen.mean(), std::sqrt((seen.array() - seen.mean()).square().mean())};
}

}  // namespace

std::array<double, 2> run_correlation(const MixedModel& model, const NullFit& fit, const Components& residual,
                                      std::mt19937_64& random) {
  constexpr double kRounding = 1e-9;
  std::array<double, 2> result = {0, 0};
  const bool neighbours = std::any_of(model.blocks().begin(), model.blocks().end(),
                                      [](const auto& runs) { return runs.size() > 1; });
  if (!neighbours) return result;
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    if (!model.strata()[s].means()) continue;
    Stacked column = model.stack(s, {&residual});
    model.project(s, fit.ratio[s], column);
    const double seen = of_neighbours(model, s, column)(0);
    const Spread none = simulated(model, fit, s, 0, random);
    if (seen < none.mean + 2 * none.deviation) continue;
    const Spread known = simulated(model, fit, s, kKnown, random);
    // Of blocks that are groups of two runs it is −1/2 whatever the correlation.
    if (!(none.deviation > kRounding) || known.mean - none.mean < 2 * none.deviation) continue;
    result[model.strata()[s].side()] =
        std::clamp(kKnown * (seen - none.mean) / (known.mean - none.mean), 0.0, kMostCorrelated);
  }
  return result;
}

double row_correlation(const Observations& observations, const std::vector<int>& rows,
                       const Eigen::VectorXd& residual) {
  constexpr double kFarFromIndependent = 3;  // standard deviations of 1/√n
  double products = 0, pairs = 0;
  for (std::size_t r = 1; r < rows.size(); ++r) {
    const auto row = static_cast<std::size_t>(rows[r]), before = static_cast<std::size_t>(rows[r - 1]);
    if (observations.group[row] != observations.group[before]) continue;
    products += residual(static_cast<Index>(r)) * residual(static_cast<Index>(r) - 1);
    ++pairs;
  }
  const double variance = residual.squaredNorm() / static_cast<double>(residual.size());
  if (pairs == 0 || !(variance > 0)) return 0;
  const double correlation = products / pairs / variance;
  return correlation * std::sqrt(pairs) < kFarFromIndependent ? 0 : correlation;
}

}  // namespace tunnelrig
