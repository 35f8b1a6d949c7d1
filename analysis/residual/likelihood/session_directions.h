// How session variance changes products of projected columns, so that those at every variance come from one.
#pragma once

#include "analysis/residual/likelihood/mixed_model.h"

#include <vector>

namespace tunnelrig {

/// With P_a the inverse covariance V_a⁻¹ less what the baseline absorbs, of session variance a over run
/// variance,
///
///   P_a = P_0 − Σ_i w_i(a) e_i e_iᵀ,   w_i(a) = a λ_i/(1 + a λ_i),
///
/// λ_i, e_i from ZᵀP_0Z of the blocks' indicators Z: there are no more of them than blocks. The same e_i
/// serve all modes of a stratum.
class SessionDirections {
 public:
  SessionDirections(const MixedModel& model, std::size_t stratum);

  /// e_iᵀ of columns that were projected at ratio 0: (directions · modes) × columns.
  Stacked coordinates(const Stacked& projected) const;

  /// w_i(a), one for each row of coordinates.
  Eigen::VectorXd weights(double session_ratio) const;

 private:
  /// uᵀ of each block: blocks × columns.
  Eigen::MatrixXd in_blocks(const Eigen::Ref<const Eigen::MatrixXd>& columns) const;

  Eigen::Index modes_;
  std::vector<std::vector<Eigen::Index>> blocks_;  // runs of each, no others than the model's
  Eigen::VectorXd of_blocks_;   // u: of each run, what whitening leaves of its block's indicator
  Eigen::MatrixXd directions_;  // blocks × directions: of Σ u, what makes e_i once it is projected
  Eigen::VectorXd lambda_;
};

}  // namespace tunnelrig
