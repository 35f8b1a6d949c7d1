// Least squares while rows are taken out one after another, without a fit anew for each.
#pragma once

#include "calibration/regression.h"

#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// What the rows that are left say.
struct RestFit {
  Eigen::VectorXd coefficients;    // β
  Eigen::MatrixXd inverse_normal;  // (XᵀX)⁻¹
  double residual_sum = 0;         // of squares
  int dof = 0;                     // rows − columns

  explicit RestFit(const Regression& fit)
      : coefficients(fit.coefficients),
        inverse_normal(fit.inverse_normal),
        residual_sum(fit.residual_sum),
        dof(fit.dof) {}

  double variance() const { return dof > 0 ? residual_sum / dof : 0; }
};

/// An order in which rows are taken out, and the fit of the others at every step.
struct Removal {
  std::vector<Eigen::Index> order;
  std::vector<RestFit> rests;  // rests[k]: without the first k of `order`; it ends where the rest has no fit

  const RestFit* without(std::size_t count) const { return count < rests.size() ? &rests[count] : nullptr; }
};

/// Takes `count` rows out in the order given.
Removal remove_in_order(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, std::vector<Eigen::Index> order,
                        Eigen::Index count);

/// Takes the row with the largest deletion residual out, `count` times.
Removal remove_stepwise(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, Eigen::Index count);

}  // namespace tunnelrig
