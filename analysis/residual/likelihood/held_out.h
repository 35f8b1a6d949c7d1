// How well a model predicts runs that its fit did not see.
#pragma once

#include "analysis/residual/likelihood/likelihood.h"

#include <span>
#include <vector>

namespace tunnelrig {

/// Errors of the held-out runs. A run whose group the fit did not see has none, nor has one on which a column
/// acts whose amplitude the fitted runs leave undetermined; it is left out of every figure.
struct HeldOutErrors {
  std::vector<int> rows;
  Eigen::MatrixXd
      error;  // rows × channels, response's unit, predicted less measured; NaN where there is none
  Eigen::MatrixXd expected_std;  // what the error would scatter by if the mean model were exact, likewise
  Eigen::VectorXd whitened;      // V^(−½)e over all strata; 0 where there is none
  double loss() const { return whitened.squaredNorm(); }  // eᵀV⁻¹e: what models are compared by
  Eigen::VectorXd amplitude;                              // of the columns, from the fit
  bool undetermined = false;  // whether runs have no error because the fit leaves their effect undetermined

  double sum_of_squares() const;  // of the errors that there are
  Eigen::Index count() const;
};

/// Amplitudes of columns by generalised least squares, baseline taken out.
struct AmplitudeFit {
  Eigen::VectorXd amplitude;
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd information = {};  // whose inverse that is, where it has one
};
AmplitudeFit fit_amplitudes(const Observations& observations, const Components& y,
                            const std::vector<Components>& columns, const NullFit& null,
                            const std::vector<int>& rows);

/// What columns, one at least, do together at these amplitudes.
Components combined(std::span<const Components> columns, const Eigen::VectorXd& amplitude);

/// y less the columns at the amplitudes that fit best, the baseline still in it.
Components left_beside(const Observations& observations, Components y, const std::vector<Components>& columns,
                       const NullFit& null, const std::vector<int>& rows);

/// Fits group constants and the columns' amplitudes to y of `fit_rows` by generalised least squares with the
/// variances of `null`, then predicts `test_rows`. Where a test run's group was not seen but the groups lie
/// within blocks, the group's constant comes from every other run of it and the errors from the rest.
HeldOutErrors predict_held_out(const Observations& observations, const Components& y,
                               const std::vector<Components>& columns, const NullFit& null,
                               const std::vector<int>& fit_rows, const std::vector<int>& test_rows);

/// A group that lies in blocks that are held out whole: rows of it that give its own baseline, and the
/// others, which are scored; places among the held-out rows.
struct OwnBaseline {
  std::vector<Eigen::Index> fitted, scored;
};
/// Those of `test_rows`; none where the baseline of a group that the fit has not seen is not known.
std::vector<OwnBaseline> own_baselines(const Observations& observations, const std::vector<int>& fit_rows,
                                       const std::vector<int>& test_rows);

}  // namespace tunnelrig
