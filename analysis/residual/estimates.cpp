// Intervals of errors and of parameters.
#include "analysis/residual/explanation_parts.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void set_interval(const Observations& observations, const HeldOutErrors& errors, std::uint64_t seed,
                  ErrorEstimate& estimate) {
  std::map<int, std::pair<double, double>> blocks;  // squares, count
  for (std::size_t r = 0; r < errors.rows.size(); ++r)
    for (Index c = 0; c < errors.error.cols(); ++c) {
      const double e = errors.error(static_cast<Index>(r), c);
      if (std::isnan(e)) continue;
      auto& block = blocks[observations.block[static_cast<std::size_t>(errors.rows[r])]];
      block.first += e * e;
      block.second += 1;
    }
  estimate.held_out_rmse =
      errors.count() == 0 ? 0 : std::sqrt(errors.sum_of_squares() / static_cast<double>(errors.count()));
  estimate.held_out_low = estimate.held_out_high = estimate.held_out_rmse;
  if (blocks.size() < 2 || !(estimate.held_out_rmse > 0)) return;
  std::vector<std::pair<double, double>> list;
  for (const auto& [id, block] : blocks) list.push_back(block);
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::size_t> pick(0, list.size() - 1);
  constexpr int kResamples = 1000;
  double sum = 0, squares = 0;
  for (int k = 0; k < kResamples; ++k) {
    double total = 0, count = 0;
    for (std::size_t b = 0; b < list.size(); ++b) {
      const auto& block = list[pick(random)];
      total += block.first;
      count += block.second;
    }
    const double value = 0.5 * std::log(total / count);
    sum += value;
    squares += value * value;
  }
  const double n = static_cast<double>(list.size());
  // The bootstrap's variance of a mean is short by (n − 1)/n.
  const double variance =
      std::max(0.0, squares / kResamples - sum * sum / kResamples / kResamples) * n / (n - 1);
  // Runs scatter within blocks too: no estimate from N errors is better than 1/(2N) of its square.
  const double least = 1 / (2.0 * static_cast<double>(errors.count()));
  const double half = student_t_quantile(0.975, std::max(n - 1, 3.0)) * std::sqrt(std::max(variance, least));
  estimate.held_out_low = estimate.held_out_rmse * std::exp(-half);
  estimate.held_out_high = estimate.held_out_rmse * std::exp(half);
}

std::vector<std::vector<ParameterEstimate>> estimate_parameters(const Observations& observations,
                                                                const JointFit& fit,
                                                                const std::vector<int>& rows) {
  MeanModel free = fit.model;  // theory's coefficients are fitted too, to show what the data say of them
  for (Term& term : free.terms)
    if (!term.effect->theory_only) term.at_theory = false;
  const MeanModel centre = refit(observations, free, fit.variances, rows);
  std::vector<std::vector<std::vector<double>>> values(centre.terms.size());
  for (std::size_t t = 0; t < values.size(); ++t) values[t].resize(centre.terms[t].parameters.size());
  std::set<int> blocks;
  for (const int row : rows) blocks.insert(observations.block[static_cast<std::size_t>(row)]);
  const std::size_t folds = std::min<std::size_t>(blocks.size(), 24);
  std::map<int, std::size_t> fold_of;
  for (const int block : blocks) fold_of.emplace(block, fold_of.size() % folds);
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<int> kept;
    for (const int row : rows)
      if (fold_of.at(observations.block[static_cast<std::size_t>(row)]) != fold) kept.push_back(row);
    const MeanModel model = refit(observations, centre, fit.variances, kept);
    for (std::size_t t = 0; t < values.size(); ++t)
      for (std::size_t k = 0; k < values[t].size(); ++k) values[t][k].push_back(model.terms[t].parameters[k]);
  }
  std::vector<std::vector<ParameterEstimate>> result(values.size());
  const double n = static_cast<double>(folds);
  for (std::size_t t = 0; t < values.size(); ++t) {
    for (std::size_t k = 0; k < values[t].size(); ++k) {
      const EffectParameter& parameter = fit.model.terms[t].effect->parameters[k];
      const double mean = std::accumulate(values[t][k].begin(), values[t][k].end(), 0.0) / n;
      double squares = 0;
      for (const double value : values[t][k]) squares += (value - mean) * (value - mean);
      const double half = student_t_quantile(0.975, n - 1) * std::sqrt((n - 1) / n * squares);
      const bool theory = k == 0 && fit.model.terms[t].at_theory;
      const double value = theory ? fit.model.terms[t].parameters[k] : centre.terms[t].parameters[k];
      const double middle = centre.terms[t].parameters[k];
      result[t].push_back({parameter.name, parameter.unit, value, middle - half, middle + half, theory});
    }
  }
  return result;
}

ParameterEstimate estimate_over_groups(const Observations& observations, const Term& term,
                                       const std::vector<int>& rows) {
  Term unit = term;
  unit.per_group = false;
  unit.parameters[0] = 0;
  const MatrixXd x = respond(unit, observations, predict_response(observations, {}, rows)).derivative[0][0];
  std::map<int, std::vector<int>> groups;
  for (const int row : rows) groups[observations.group[static_cast<std::size_t>(row)]].push_back(row);
  std::vector<double> amplitudes;
  for (const auto& [group, own] : groups) {
    const VectorXd u = x(own, 0).array() - x(own, 0).mean(),
                   y = observations.y(own, 0).array() - observations.y(own, 0).mean();
    if (u.squaredNorm() > 0) amplitudes.push_back(u.dot(y) / u.squaredNorm());
  }
  const auto quantile = [&amplitudes](double p) {
    std::sort(amplitudes.begin(), amplitudes.end());
    return amplitudes[static_cast<std::size_t>(std::clamp(p, 0.0, 1.0) *
                                               static_cast<double>(amplitudes.size() - 1))];
  };
  const double half =
      1.96 / (2 * std::sqrt(static_cast<double>(amplitudes.size())));  // order statistics of a median
  const EffectParameter& parameter = term.effect->parameters[0];
  return {parameter.name, parameter.unit, quantile(0.5), quantile(0.5 - half), quantile(0.5 + half), false};
}

std::string unit_of(const Observations& observations, const EffectParameter& parameter) {
  const bool volts = parameter.unit == "V" || parameter.unit.starts_with("V/");
  if (!volts || (observations.newtons_per_volt.array() != 1).any()) return parameter.unit;
  return observations.unit + parameter.unit.substr(1);
}

}  // namespace tunnelrig
