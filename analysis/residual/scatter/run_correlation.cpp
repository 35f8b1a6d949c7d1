#include "analysis/residual/scatter/run_correlation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tunnelrig {
namespace {

using Eigen::Index;

constexpr std::size_t kSimulated = 100;
constexpr double kKnown = 0.5;  // correlation of the second simulation

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

/// Restricted log likelihood of a residual in one stratum, of the session variance that is likeliest.
double log_likelihood(const MixedModel& model, std::size_t stratum, const Stacked& residual) {
  const auto dof = static_cast<double>(model.dof(stratum));
  double best = -std::numeric_limits<double>::infinity();
  for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
    Stacked left = residual;
    model.project(stratum, ratio, left);
    best = std::max(best, -0.5 * dof * std::log(left.squaredNorm()) - model.log_determinant(stratum, ratio));
  }
  return best;
}

/// Where a parabola through three values, `step` from each other, is highest: from the middle one.
double highest(double before, double here, double after, double step) {
  const double bend = before - 2 * here + after;
  return bend < 0 ? step * 0.5 * (before - after) / bend : 0;
}

/// Of each side that was found to be correlated (others: 0) the likeliest correlation.
std::array<double, 2> likeliest(Observations observations, const MixedModel& model,
                                const Components& residual, std::array<bool, 2> found) {
  constexpr double kStep = 0.1;
  constexpr int kSteps = 9;  // no more than 0.9
  std::array<std::array<double, kSteps + 1>, 2> likelihood = {};
  for (int i = 0; i <= kSteps; ++i) {
    observations.scatter.run_correlation = {i * kStep, i * kStep};
    const MixedModel correlated(observations, model.rows());
    for (std::size_t s = 0; s < model.strata().size(); ++s)
      if (const MixedModel::Stratum& stratum = model.strata()[s]; stratum.means() && found[stratum.side()])
        likelihood[stratum.side()][static_cast<std::size_t>(i)] +=
            log_likelihood(correlated, s, model.stack(s, {&residual}));
  }
  std::array<double, 2> result = {0, 0};
  for (std::size_t side = 0; side < found.size(); ++side) {
    if (!found[side]) continue;
    const auto& of = likelihood[side];
    const auto at = static_cast<std::size_t>(std::ranges::max_element(of) - of.begin());
    result[side] = static_cast<double>(at) * kStep;
    if (at > 0 && at < of.size() - 1) result[side] += highest(of[at - 1], of[at], of[at + 1], kStep);
  }
  return result;
}

}  // namespace

std::array<double, 2> run_correlation(const Observations& observations, const MixedModel& model,
                                      const NullFit& fit, const Components& residual,
                                      std::mt19937_64& random) {
  constexpr double kRounding = 1e-9;
  const bool neighbours = std::any_of(model.blocks().begin(), model.blocks().end(),
                                      [](const auto& runs) { return runs.size() > 1; });
  if (!neighbours) return {0, 0};
  std::array<bool, 2> found = {false, false};
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    if (!model.strata()[s].means()) continue;
    Stacked column = model.stack(s, {&residual});
    model.project(s, fit.ratio[s], column);
    const double seen = of_neighbours(model, s, column)(0);
    const Spread none = simulated(model, fit, s, 0, random);
    if (seen < none.mean + 2 * none.deviation) continue;
    const Spread known = simulated(model, fit, s, kKnown, random);
    // Of blocks that are groups of two runs it is −1/2 whatever the correlation.
    if (none.deviation > kRounding && known.mean - none.mean >= 2 * none.deviation)
      found[model.strata()[s].side()] = true;
  }
  if (found == std::array{false, false}) return {0, 0};
  return likeliest(observations, model, residual, found);
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
