// Whether an effect does within blocks what it does from one block to the next.
#include "analysis/residual/explanation/explanation_parts.h"

#include <algorithm>
#include <cmath>

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

/// Whether a condition of the effect differs within blocks by more than rounding.
bool differs_within_blocks(const Observations& observations, const Effect& effect) {
  constexpr double kRounding = 1e-9;
  return std::ranges::any_of(effect.covariates, [&](const std::string& name) {
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
};

/// `k`: the column of the fit, in place of which `between` and the rest of it are fitted.
TwoAmplitudes apart(const Observations& observations, const JointFit& fit, std::size_t k,
                    const MatrixXd& between, const std::vector<int>& rows) {
  std::vector<Components> columns = fit.linear.columns;
  columns.push_back(columns[k]);
  columns[k][0] -= between;
  columns.back()[0] = between;
  const Components y = difference(response_components(observations), fit.linear.offset);
  const AmplitudeFit both = fit_amplitudes(observations, y, columns, fit.variances, rows);
  const MatrixXd& covariance = both.covariance;
  const auto one = static_cast<Index>(k), two = both.amplitude.size() - 1;
  return {both.amplitude(one), both.amplitude(two),
          std::sqrt(std::max(0.0, covariance(one, one) + covariance(two, two) - 2 * covariance(one, two)))};
}

}  // namespace

void warn_of_blocks_of_their_own(const Observations& observations, const JointFit& fit,
                                 const std::vector<int>& rows, Explanation& explanation) {
  constexpr double kApart = 3;  // standard errors
  constexpr double kRounding = 1e-12;
  if (observations.blocks_are_rows) return;
  for (std::size_t t = 0; t < explanation.adopted.size(); ++t) {
    const std::optional<Index> place = fit.linear.column_of({t, 0});
    const AdoptedEffect& adopted = explanation.adopted[t];
    if (!place || is_at_bound(fit.model.terms[t], 0) ||
        !differs_within_blocks(observations, *adopted.term.effect))
      continue;
    const auto k = static_cast<std::size_t>(*place);
    const Components& column = fit.linear.columns[k];
    const bool of_courses =
        std::any_of(column.begin() + 1, column.end(), [](const MatrixXd& own) { return !own.isZero(0); });
    const MatrixXd beside = column[0] - means_of_each(observations.group, column[0]);
    const MatrixXd between = means_of_each(observations.block, beside);
    const double all = column[0].squaredNorm();
    if (of_courses || between.squaredNorm() < kRounding * all) continue;
    const TwoAmplitudes of = apart(observations, fit, k, between, rows);
    if (!(std::abs(of.within - of.between) > kApart * of.standard_error)) continue;
    const ParameterEstimate& amplitude = adopted.parameters[0];
    const std::string unit = amplitude.unit == "1" ? "" : " " + amplitude.unit;
    const double value = fit.model.terms[t].parameters[0];
    const char* block = observations.from_table ? "block" : "session";
    explanation.warnings.push_back(fmt::format(
        "{}: its {} is {:.3g}{} within {}s and {:.3g}{} from one to the next, {:.1f} standard errors apart: "
        "its condition was read too coarsely to be followed within a {}, or something else changes with it",
        adopted.term.label(), amplitude.name, value + of.within, unit, block, value + of.between, unit,
        std::abs(of.within - of.between) / of.standard_error, block));
  }
}

}  // namespace tunnelrig
