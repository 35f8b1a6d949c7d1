// How far a fitted model is from runs, its own and others.
#pragma once

#include "analysis/residual/likelihood/joint_fit.h"

#include <vector>

namespace tunnelrig {

/// Errors of the fitted runs themselves, n × c in the unit.
Eigen::MatrixXd residuals(const Observations& observations, const JointFit& fit,
                          const std::vector<int>& rows);

/// Of the finite ones; 0 of none.
double rms(const Eigen::MatrixXd& errors);

/// Errors of runs that a fit of others predicts.
HeldOutErrors score(const Observations& observations, const JointFit& fit, const std::vector<int>& fit_rows,
                    const std::vector<int>& test_rows);

/// Errors of the fitted runs, each block predicted from the others.
HeldOutErrors left_out(const Observations& observations, const JointFit& fit, const std::vector<int>& rows);

}  // namespace tunnelrig
