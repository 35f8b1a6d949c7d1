// Intervals of errors and of parameters.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/likelihood/cross_validation.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <random>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct BlockSquares {
  double sum = 0, count = 0;
};

std::vector<BlockSquares> squares_of_blocks(const Observations& observations, const HeldOutErrors& errors) {
  std::map<int, BlockSquares> blocks;
  for (std::size_t r = 0; r < errors.rows.size(); ++r)
    for (const double e : errors.error.row(static_cast<Index>(r))) {
      if (std::isnan(e)) continue;
      BlockSquares& block = blocks[observations.block[static_cast<std::size_t>(errors.rows[r])]];
      block.sum += e * e;
      block.count += 1;
    }
  std::vector<BlockSquares> list;
  for (const auto& [id, block] : blocks) list.push_back(block);
  return list;
}

/// Bootstrap variance of ln(rms) of as many blocks as `drawn`, out of `blocks`: of one block nothing is known
/// of how blocks differ.
double variance_of_log_rms(const std::vector<BlockSquares>& blocks, std::size_t drawn,
                           std::mt19937_64& random) {
  if (blocks.size() < 2) return 0;
  constexpr int kResamples = 1000;
  std::uniform_int_distribution<std::size_t> pick(0, blocks.size() - 1);
  std::vector<double> values;
  for (int k = 0; k < kResamples; ++k) {
    BlockSquares all;
    for (std::size_t b = 0; b < drawn; ++b) {
      const BlockSquares& block = blocks[pick(random)];
      all.sum += block.sum;
      all.count += block.count;
    }
    if (all.sum > 0) values.push_back(std::log(all.sum / all.count) / 2);
  }
  if (values.empty()) return 0;
  const Eigen::Map<const Eigen::ArrayXd> value(values.data(), static_cast<Index>(values.size()));
  const double n = static_cast<double>(blocks.size());
  return (value - value.mean()).square().mean() * n / (n - 1);  // a bootstrap's is short by (n − 1)/n
}

}  // namespace

void set_interval(const Observations& observations, const HeldOutErrors& sealed, const HeldOutErrors& open,
                  std::uint64_t seed, ErrorEstimate& estimate) {
  const double count = static_cast<double>(sealed.count());
  estimate.held_out_rmse = count > 0 ? std::sqrt(sealed.sum_of_squares() / count) : 0;
  estimate.held_out_low = estimate.held_out_high = estimate.held_out_rmse;
  if (!(estimate.held_out_rmse > 0)) return;
  const std::vector<BlockSquares> blocks = squares_of_blocks(observations, sealed);
  const std::vector<BlockSquares> others = squares_of_blocks(observations, open);
  std::mt19937_64 random(seed);
  // How a few sealed blocks differ says little of how blocks do, so the open ones count as well, but for no
  // more than the sealed ones do: these may lie where something else is at work.
  constexpr double kFewest = 3;
  const double of_sealed = static_cast<double>(blocks.size()) - 1;
  const double of_open =
      std::min(std::max(0.0, static_cast<double>(others.size()) - 1), std::max(of_sealed, kFewest));
  const double dof = of_sealed + of_open;
  double variance = 0;
  if (dof > 0)
    variance = (of_sealed * variance_of_log_rms(blocks, blocks.size(), random) +
                of_open * variance_of_log_rms(others, blocks.size(), random)) /
               dof;
  // Runs scatter within blocks too: no estimate from N errors is better than 1/(2N) of its square.
  variance = std::max(variance, 1 / (2 * count));
  const double t = student_t_quantile(0.975, std::max(dof, kFewest));
  const double half = t * std::sqrt(variance);
  // The logarithm of χ² is skewed: few blocks are more often too calm than too wild. The first terms of
  // Cornish & Fisher (1938) for its mean, −v/2, and its third moment, −v², of ln rms² with variance v.
  const double up = std::min(variance * (t * t + 2) / 3, half / 2);
  estimate.held_out_low = estimate.held_out_rmse * std::exp(up - half);
  estimate.held_out_high = estimate.held_out_rmse * std::exp(up + half);
}

namespace {

/// Every parameter with all rows, and with each fold's blocks left out: by term, then parameter. Folds to
/// whose runs the model cannot be fitted say nothing.
struct Jackknife {
  MeanModel centre;
  std::vector<std::vector<std::vector<double>>> values;  // by fold, last
  std::size_t folds = 0;

  /// Their sum of squares is the parameter's variance.
  std::vector<double> deviations(std::size_t term, std::size_t parameter) const {
    std::vector<double> of = values[term][parameter];
    const double n = static_cast<double>(of.size());
    const double mean = std::accumulate(of.begin(), of.end(), 0.0) / n;
    for (double& value : of) value = (value - mean) * std::sqrt((n - 1) / n);
    return of;
  }
};

Jackknife jackknife(const Observations& observations, const MeanModel& model, const NullFit& variances,
                    const std::vector<int>& rows, const std::vector<Fold>& folds) {
  Jackknife result{refit(observations, model, variances, rows).value_or(model), {}};
  for (const Term& term : model.terms) result.values.emplace_back(term.parameters.size());
  for (const Fold& fold : folds) {
    const auto without = refit(observations, result.centre, variances, fold.kept);
    if (!without) continue;
    ++result.folds;
    for (std::size_t t = 0; t < without->terms.size(); ++t)
      for (std::size_t k = 0; k < without->terms[t].parameters.size(); ++k)
        result.values[t][k].push_back(without->terms[t].parameters[k]);
  }
  return result;
}

}  // namespace

std::vector<std::vector<ParameterEstimate>> estimate_parameters(const Observations& observations,
                                                                const JointFit& fit,
                                                                const std::vector<int>& rows) {
  const std::vector<Fold> folds = leave_out_blocks(observations, rows);
  const Jackknife found = jackknife(observations, fit.model, fit.variances, rows, folds);
  std::vector<std::vector<ParameterEstimate>> result(fit.model.terms.size());
  for (std::size_t t = 0; t < result.size(); ++t) {
    const Term& term = fit.model.terms[t];
    // Theory's coefficient is fitted as well, alone, to show what the data say of it.
    std::optional<Jackknife> freed;
    if (term.at_theory && !term.effect->theory_only) {
      MeanModel free = fit.model;
      free.terms[t].at_theory = false;
      freed = jackknife(observations, free, fit.variances, rows, folds);
    }
    for (std::size_t k = 0; k < term.parameters.size(); ++k) {
      const EffectParameter& parameter = term.effect->parameters[k];
      const bool theory = k == 0 && term.at_theory;
      const Jackknife& says = theory && freed ? *freed : found;
      std::vector<double> deviations = says.deviations(t, k);
      const bool known = says.folds > 1;
      const double error =
          known ? std::sqrt(std::inner_product(deviations.begin(), deviations.end(), deviations.begin(), 0.0))
                : parameter.upper - parameter.lower;
      const double half = known ? half_width_95(error, static_cast<double>(says.folds) - 1) : error;
      const double middle = says.centre.terms[t].parameters[k];
      // No time is below zero. What an amplitude's interval says of its sign stays said.
      const bool bounded = !known || parameter.role == ParameterRole::kShape;
      result[t].push_back({.name = parameter.name,
                           .unit = parameter.unit,
                           .value = found.centre.terms[t].parameters[k],
                           .low = bounded ? std::max(middle - half, parameter.lower) : middle - half,
                           .high = bounded ? std::min(middle + half, parameter.upper) : middle + half,
                           .standard_error = error,
                           .deviations = std::move(deviations),
                           .theory = theory});
    }
  }
  return result;
}

namespace {

/// Of n sorted values, how many lie on either side of the narrowest interval between two of them that holds
/// the median with 95 %: each value is below it or above as a coin falls (David & Nagaraja, Order Statistics,
/// 2003).
std::size_t outside_median_interval(std::size_t n) {
  constexpr double kBeyond = 0.025;
  const auto of = static_cast<double>(n);
  double tail = 0;  // P(at most k of n); 0.5ⁿ itself is less than the least number from n = 1,075 on
  for (double k = 0; k < of; ++k) {
    tail += std::exp(std::lgamma(of + 1) - std::lgamma(k + 1) - std::lgamma(of - k + 1) - of * std::log(2.0));
    if (tail > kBeyond) return static_cast<std::size_t>(std::max(k - 1, 0.0));
  }
  return 0;
}

}  // namespace

ParameterEstimate summary_of_groups(const EffectParameter& parameter, std::vector<GroupEstimate> groups) {
  constexpr std::size_t kFewestForOrder = 6;  // the median of fewer lies outside their range too often
  ParameterEstimate result{.name = parameter.name, .unit = parameter.unit, .groups = groups};
  if (groups.empty()) return result;
  std::sort(groups.begin(), groups.end(),
            [](const GroupEstimate& a, const GroupEstimate& b) { return a.value < b.value; });
  const std::size_t n = groups.size();
  result.value = (groups[(n - 1) / 2].value + groups[n / 2].value) / 2;
  if (n < kFewestForOrder) {
    result.low =
        std::min_element(groups.begin(), groups.end(), [](auto& a, auto& b) { return a.low < b.low; })->low;
    result.high = std::max_element(groups.begin(), groups.end(), [](auto& a, auto& b) {
                    return a.high < b.high;
                  })->high;
    return result;
  }
  const std::size_t outside = outside_median_interval(n);
  result.low = groups[outside].value;
  result.high = groups[n - 1 - outside].value;
  return result;
}

std::string unit_of(const Observations& observations, const Effect& effect, std::size_t k) {
  const EffectParameter& parameter = effect.parameters[k];
  if (effect.form_is_axis) return parameter.unit;  // made of the table's own units
  if (observations.from_table && parameter.per_newton())
    return observations.unit == "1" ? "1" : "1/" + observations.unit;
  if (!parameter.in_volts() || (observations.newtons_per_volt.array() != 1).any()) return parameter.unit;
  return observations.unit + parameter.unit.substr(1);
}

}  // namespace tunnelrig
