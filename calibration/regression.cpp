#include "calibration/regression.h"

#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/QR>

namespace tunnelrig {

std::optional<Regression> regress(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  const Eigen::Index n = X.rows(), p = X.cols();
  if (n < p) return {};
  // columns to one length, so that rank does not depend on units
  const Eigen::VectorXd scale = X.colwise().norm();
  if ((scale.array() == 0).any()) return {};
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(X * scale.cwiseInverse().asDiagonal());
  if (qr.rank() < p) return {};
  Regression fit;
  fit.coefficients = qr.solve(y).cwiseQuotient(scale);
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(n, p);
  const Eigen::MatrixXd r_inverse =
      qr.matrixR().topRows(p).triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(p, p));
  const Eigen::MatrixXd root = scale.cwiseInverse().asDiagonal() * (qr.colsPermutation() * r_inverse);
  fit.inverse_normal = root * root.transpose();
  fit.residuals = y - X * fit.coefficients;
  fit.leverage = q.rowwise().squaredNorm();
  fit.residual_sum = fit.residuals.squaredNorm();
  fit.dof = static_cast<int>(n - p);
  return fit;
}

Eigen::MatrixXd rows_where(const Eigen::MatrixXd& X, const Eigen::Array<bool, Eigen::Dynamic, 1>& keep) {
  Eigen::MatrixXd kept(keep.count(), X.cols());
  Eigen::Index next = 0;
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    if (keep[i]) kept.row(next++) = X.row(i);
  }
  return kept;
}

std::optional<AddedTerm> test_added_term(const Eigen::MatrixXd& X, const Eigen::VectorXd& term,
                                         const Eigen::VectorXd& y) {
  Eigen::MatrixXd wider(X.rows(), X.cols() + 1);
  wider << X, term;
  const auto fit = regress(wider, y);
  if (!fit || fit->dof < 1) return {};
  const Eigen::Index last = X.cols();
  // at least rounding, so that a perfect line does not make a term of it
  const double scatter = std::max(std::sqrt(fit->variance()), rounding_floor(y));
  AddedTerm added;
  added.coefficient = fit->coefficients[last];
  added.standard_error = scatter * std::sqrt(fit->inverse_normal(last, last));
  added.p = student_t_two_sided_p(added.coefficient / added.standard_error, fit->dof);
  return added;
}

double rounding_floor(const Eigen::VectorXd& y) {
  return 64 * std::numeric_limits<double>::epsilon() * std::max(y.cwiseAbs().maxCoeff(), 1e-300);
}

}  // namespace tunnelrig
