// How session variance changes products of projected columns, so that those at every variance come from one.
#pragma once

#include "analysis/residual/likelihood/mixed_model.h"

#include <vector>

namespace tunnelrig {

/// With P_a the inverse covariance V_a⁻¹ less what the baseline absorbs, of session variance a over run
/// variance, and Z the blocks' indicators,
///
///   P_a = P_0 − P_0 Z a (1 + a ZᵀP_0Z)⁻¹ ZᵀP_0
///
/// Of few blocks, which data sets are many of, the inverse is that of a diagonal: ZᵀP_0Z has eigenvalues λ_i,
/// and of these directions a (1 + a λ_i)⁻¹ is left. They cost the cube of the blocks; of many, the equations
/// are solved at each variance by the model's sparse factors. The same serves all modes of a stratum.
class SessionDirections {
 public:
  /// Of more blocks than this there are no directions.
  static constexpr Eigen::Index kMostBlocks = 128;

  /// Keeps the model's address.
  SessionDirections(const MixedModel& model, std::size_t stratum, Eigen::Index most_blocks = kMostBlocks);

  /// Columns that were projected at ratio 0, in directions (or blocks): (directions · modes) × columns.
  Stacked coordinates(const Stacked& projected) const;

  /// Of such coordinates, a row for each direction of one mode or of several: what their products with others
  /// are less at a session variance.
  Stacked weighted(std::size_t ratio, const Stacked& coordinates) const;

 private:
  /// uᵀ of each block: blocks × columns.
  Eigen::MatrixXd in_blocks(const Eigen::Ref<const Eigen::MatrixXd>& columns) const;

  const MixedModel* model_;
  std::size_t stratum_;
  Eigen::Index modes_, count_ = 0;  // of directions, or blocks
  Eigen::VectorXd of_blocks_;       // u: of each run, what whitening leaves of its block's indicator
  bool few_;                        // blocks, so that there are directions
  Eigen::MatrixXd directions_;      // blocks × directions, of length 1
  Eigen::VectorXd lambda_;
};

}  // namespace tunnelrig
