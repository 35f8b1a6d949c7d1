// What an effect that depends on the force of the run before is told of it.
#pragma once

#include "analysis/residual/observations/observations.h"

namespace tunnelrig {

/// n × c, in y's scale: of the error of the constant of each run's group, by what is left beside `predicted`.
Eigen::MatrixXd variance_of_constants(const Observations& observations, const Eigen::MatrixXd& predicted);

/// By forces that a model predicts (n × c, in the response's unit); both arguments must outlive it.
class PreviousRun {
 public:
  PreviousRun(const Observations& observations, const Eigen::MatrixXd& predicted);

  /// Its force; this run's own where that was nearly the same at the same place: which of the two was larger
  /// depends on what the model does not have. NaN: there is none.
  double force_N(Eigen::Index row, Eigen::Index channel) const;

  /// Standard error of the difference between the forces of this run and the one before it.
  double error_N(Eigen::Index row, Eigen::Index channel) const;

 private:
  double force_of(Eigen::Index row, Eigen::Index channel) const;

  const Observations& observations_;
  const Eigen::MatrixXd& predicted_;
  Eigen::MatrixXd
      constant_variance_;  // n × c, in y's scale: of the error of the constant of each run's group
};

}  // namespace tunnelrig
