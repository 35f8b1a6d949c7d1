// Ordinary least squares in closed form, for the tests and the searches around a fit (the fits themselves are
// Ceres's).
#pragma once

#include <optional>

#include <Eigen/Core>

namespace tunnelrig {

/// y = X β + ε with independent ε of one variance.
struct Regression {
  Eigen::VectorXd coefficients;    // β
  Eigen::MatrixXd inverse_normal;  // (XᵀX)⁻¹
  Eigen::VectorXd residuals;       // y − X β
  Eigen::VectorXd leverage;        // diagonal of X (XᵀX)⁻¹ Xᵀ
  double residual_sum = 0;         // of squares
  int dof = 0;                     // rows − columns

  double variance() const { return dof > 0 ? residual_sum / dof : 0; }
};

/// Nothing where X has fewer rows than columns, or columns that depend on each other.
std::optional<Regression> regress(const Eigen::MatrixXd& X, const Eigen::VectorXd& y);

/// The rows of X, or elements of y, that `keep` is true for.
Eigen::MatrixXd rows_where(const Eigen::MatrixXd& X, const Eigen::Array<bool, Eigen::Dynamic, 1>& keep);

/// What a further column would add to the model, and whether it is more than noise.
struct AddedTerm {
  double coefficient = 0;
  double standard_error = 0;
  double p = 1;  // two-sided t test
};

/// Nothing where the term cannot be told from the columns of X, or no degree of freedom would be left.
std::optional<AddedTerm> test_added_term(const Eigen::MatrixXd& X, const Eigen::VectorXd& term,
                                         const Eigen::VectorXd& y);

/// Residuals of y smaller than this are rounding, not scatter.
double rounding_floor(const Eigen::VectorXd& y);

}  // namespace tunnelrig
