// Whether runs of some locations or sessions scatter more than others: near a wall, in a draught.
#pragma once

#include "analysis/residual/likelihood/likelihood.h"

#include <random>

namespace tunnelrig {

/// What is left of each run beside a model and columns, over σ, summed over the modes; and of the runs of
/// data sets in which all scatter as the model says (a column each).
struct RunSizes {
  std::vector<int> rows;
  Eigen::VectorXd left;
  Eigen::VectorXd common;  // of what rotors have in common, with its sign
  Eigen::MatrixXd alike;
};

RunSizes run_sizes(const MixedModel& model, const NullFit& variances, const Components& y,
                   const std::vector<Components>& columns, std::mt19937_64& random);

/// n: of each run its scatter over that of most, where the runs of a group or block scatter more than twice
/// as much and beyond all of the data sets whose runs are alike; elsewhere 1. Runs that the model does not
/// hold are like the others of their group. Empty: all are alike, and for tables, whose groups are no repeats
/// of each other.
Eigen::VectorXd run_scatter(const Observations& observations, const RunSizes& sizes);

}  // namespace tunnelrig
