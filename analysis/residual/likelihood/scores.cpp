#include "analysis/residual/likelihood/scores.h"

#include <cmath>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

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
  const Components y = difference(response_components(observations), fit.linear.offset);
  return predict_held_out(observations, y, fit.linear.columns, fit.variances, fit_rows, test_rows);
}

HeldOutErrors left_out(const Observations& observations, const JointFit& fit, const std::vector<int>& rows) {
  const Components y = difference(response_components(observations), fit.linear.offset);
  return cross_validate(observations, y, fit.linear.columns, fit.variances, rows).all();
}

}  // namespace tunnelrig
