// Models compared by blocks that they did not see, one after the other.
#pragma once

#include "analysis/residual/likelihood/held_out.h"

#include <cstddef>
#include <vector>

namespace tunnelrig {

/// Blocks left out at a time, one each; of more blocks than this they are dealt out.
inline constexpr std::size_t kMostFolds = 24;
struct Fold {
  std::vector<int> kept, left_out;  // rows
};
std::vector<Fold> leave_out_blocks(const Observations& observations, const std::vector<int>& rows);

/// Leave-one-block-out over the blocks of `rows`.
struct CrossValidation {
  std::vector<HeldOutErrors> folds;

  HeldOutErrors all() const;       // rows, errors and what these are expected to be, of all folds
  Eigen::VectorXd losses() const;  // of the folds
};
CrossValidation cross_validate(const Observations& observations, const Components& y,
                               const std::vector<Components>& columns, const NullFit& null,
                               const std::vector<int>& rows);

/// Mean difference of two models' losses over the folds, and its standard error: `worse` less `better`. 0 of
/// a fold in which the two do not score the same runs.
struct LossDifference {
  double mean = 0, standard_error = 0;

  /// The same from the scatter of the fitted model: e'V⁻¹e changes by 2e'V⁻¹d + d'V⁻¹d where the predictions
  /// differ by d. Where few folds hold all of the difference, these folds' scatter says nothing of its error,
  /// and this does.
  double expected_standard_error = 0;

  double total = 0;  // twice the logarithm of the likelihood ratio of what was held out

  /// Whether the data tell the two models apart: the mean is at least two standard errors (the smaller of the
  /// two), and the likelihood ratio at least 20. Models that predict nearly the same differ by little,
  /// however surely.
  bool told_apart() const;
};
LossDifference compare(const CrossValidation& worse, const CrossValidation& better);

/// By how much the rms error of one is larger, over the folds in which both score the same runs; 0 of none.
double rmse_gain(const CrossValidation& worse, const CrossValidation& better);

}  // namespace tunnelrig
