#include "analysis/residual/likelihood/scores.h"

#include "analysis/residual/likelihood/cross_validation.h"

#include <cmath>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// The model where effects act on the forces of groups that the fit has not seen: what these are, rows of
/// their own say, as for their baseline.
LinearModel at_own_forces(const Observations& observations, const JointFit& fit,
                          const std::vector<int>& fit_rows, const std::vector<int>& test_rows) {
  std::vector<int> rows = fit_rows;
  for (const OwnBaseline& own : own_baselines(observations, fit_rows, test_rows))
    for (const Index place : own.fitted) rows.push_back(test_rows[static_cast<std::size_t>(place)]);
  if (fit.model.terms.empty() || rows.size() == fit_rows.size()) return fit.linear;
  LinearModel linear = linearise(observations, fit.model, predict_forces(observations, fit.model, rows));
  if (fit.linear.columns.empty()) linear.clear_columns();  // the fit's amplitudes are not asked for again
  return linear;
}

}  // namespace

MatrixXd residuals(const Observations& observations, const JointFit& fit, const std::vector<int>& rows) {
  const Components y = difference(response_components(observations), fit.linear.offset);
  return predict_held_out(observations, y, fit.linear.columns, fit.variances, rows, rows).error;
}

double rms(const MatrixXd& errors) {
  const auto missing = errors.array().isNaN();
  const Index count = errors.size() - missing.count();
  return count == 0 ? 0 : std::sqrt(missing.select(0, errors).squaredNorm() / static_cast<double>(count));
}

HeldOutErrors score(const Observations& observations, const JointFit& fit, const std::vector<int>& fit_rows,
                    const std::vector<int>& test_rows) {
  const LinearModel linear = at_own_forces(observations, fit, fit_rows, test_rows);
  const Components y = difference(response_components(observations), linear.offset);
  return predict_held_out(observations, y, linear.columns, fit.variances, fit_rows, test_rows);
}

HeldOutErrors left_out(const Observations& observations, const JointFit& fit, const std::vector<int>& rows) {
  const Components y = difference(response_components(observations), fit.linear.offset);
  return cross_validate(observations, y, fit.linear.columns, fit.variances, rows).all();
}

}  // namespace tunnelrig
