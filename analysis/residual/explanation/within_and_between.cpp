// Whether an effect, or a curve, does within blocks what it does from one block to the next.
#include "analysis/residual/explanation/explanation_parts.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Of the rows of each group, or block, their mean.
MatrixXd means_of_each(const std::vector<int>& belongs, const MatrixXd& values) {
  MatrixXd result = values;
  for (const auto& [number, own] : places_of_each(belongs))
    result(own, Eigen::all).rowwise() = Eigen::RowVectorXd(values(own, Eigen::all).colwise().mean());
  return result;
}

/// Whether one of these conditions differs within blocks by more than rounding.
bool differ_within_blocks(const Observations& observations, const std::vector<std::string>& names) {
  constexpr double kRounding = 1e-9;
  return std::ranges::any_of(names, [&](const std::string& name) {
    const Covariate* covariate = observations.find(name);
    if (covariate == nullptr) return false;
    const MatrixXd& all = covariate->value;
    const MatrixXd within = all - means_of_each(observations.block, all);
    return within.norm() > kRounding * (all.rowwise() - Eigen::RowVectorXd(all.colwise().mean())).norm();
  });
}

/// Amplitudes of the parts of a column that blocks differ by, and that differs within them.
struct TwoAmplitudes {
  double within = 0, between = 0, standard_error = 0;  // of their difference
  double distance() const { return standard_error > 0 ? std::abs(within - between) / standard_error : 0; }
};

/// Nothing where these differ by no more than three standard errors. What the fit's columns from `first` on,
/// `count` of them, do is `made` times an amplitude, and is split up in their place.
std::optional<TwoAmplitudes> apart(const Observations& observations, const JointFit& fit, std::size_t first,
                                   std::size_t count, Components made, const std::vector<int>& rows) {
  constexpr double kApart = 3, kRounding = 1e-12;
  const bool of_courses =
      std::any_of(made.begin() + 1, made.end(), [](const MatrixXd& own) { return !own.isZero(0); });
  const MatrixXd between =
      means_of_each(observations.block, made[0] - means_of_each(observations.group, made[0]));
  if (of_courses || between.squaredNorm() < kRounding * made[0].squaredNorm()) return {};
  std::vector<Components> columns = fit.linear.columns;
  const auto own = columns.begin() + static_cast<std::ptrdiff_t>(first);
  columns.erase(own, own + static_cast<std::ptrdiff_t>(count));
  columns.push_back(made);
  columns.back()[0] -= between;
  columns.push_back(std::move(made));
  columns.back()[0] = between;
  const Components y = difference(response_components(observations), fit.linear.offset);
  const AmplitudeFit both = fit_amplitudes(observations, y, columns, fit.variances, rows);
  const Eigen::Vector2d of = both.amplitude.tail<2>();
  const Eigen::Matrix2d covariance = both.covariance.bottomRightCorner<2, 2>();
  const TwoAmplitudes result{of(0), of(1),
                             std::sqrt(std::max(0.0, covariance.trace() - 2 * covariance(0, 1)))};
  if (!(result.distance() > kApart)) return {};
  return result;
}

void warn_of_effects(const Observations& observations, const JointFit& fit, const std::vector<int>& rows,
                     Explanation& explanation) {
  const std::string block = block_noun(observations);
  for (std::size_t t = 0; t < explanation.adopted.size(); ++t) {
    const std::optional<Index> place = fit.linear.column_of({t, 0});
    const AdoptedEffect& adopted = explanation.adopted[t];
    if (!place || is_at_bound(fit.model.terms[t], 0) ||
        !differ_within_blocks(observations, adopted.term.effect->covariates))
      continue;
    const auto k = static_cast<std::size_t>(*place);
    const auto of = apart(observations, fit, k, 1, fit.linear.columns[k], rows);
    if (!of) continue;
    const ParameterEstimate& amplitude = adopted.parameters[0];
    const std::string unit = amplitude.unit == "1" ? "" : " " + amplitude.unit;
    const double value = fit.model.terms[t].parameters[0];
    explanation.warnings.push_back(fmt::format(
        "{}: its {} is {:.3g}{} within {}s and {:.3g}{} from one to the next, {:.1f} standard errors apart: "
        "its condition was read too coarsely to be followed within a {}, or something else changes with it",
        adopted.term.label(), amplitude.name, value + of->within, unit, block, value + of->between, unit,
        of->distance(), block));
  }
}

void warn_of_curves(const Observations& observations, const JointFit& fit, const std::vector<int>& rows,
                    Explanation& explanation) {
  if (fit.model.curves.empty()) return;
  const std::string block = block_noun(observations);
  const Eigen::VectorXd amplitude =
      fit_amplitudes(observations, difference(response_components(observations), fit.linear.offset),
                     fit.linear.columns, fit.variances, rows)
          .amplitude;
  std::size_t first = fit.linear.of_parameters.size();
  for (const Curve& curve : fit.model.curves) {
    const std::size_t own = first, count = curve.columns.size();
    first += count;
    if (curve.x.size() == 0 || curve.strength || !differ_within_blocks(observations, {curve.covariate}))
      continue;
    const Components made = combined(std::span(fit.linear.columns).subspan(own, count),
                                     amplitude.segment(static_cast<Index>(own), static_cast<Index>(count)));
    const auto of = apart(observations, fit, own, count, made, rows);
    if (!of) continue;
    explanation.warnings.push_back(fmt::format(
        "what goes with {}: within {}s it is {:.2g} times its curve and from one to the next {:.2g} times, "
        "{:.1f} standard errors apart: doubt the curve's size and shape, since something else changes with "
        "it",
        curve.label(), block, of->within, of->between, of->distance()));
  }
}

}  // namespace

void warn_of_blocks_of_their_own(const Observations& observations, const JointFit& fit,
                                 const std::vector<int>& rows, Explanation& explanation) {
  if (observations.blocks_are_rows) return;
  warn_of_effects(observations, fit, rows, explanation);
  warn_of_curves(observations, fit, rows, explanation);
}

}  // namespace tunnelrig
