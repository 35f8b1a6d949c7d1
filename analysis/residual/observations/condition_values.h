// What the values of a condition let one see: whether they differ, how many there are, what goes with what.
#pragma once

#include "analysis/residual/observations/observations.h"

#include <vector>

#include <Eigen/Dense>

namespace tunnelrig {

/// Over all rows, of the first channel; 0 where one of them is constant.
double correlation(const Covariate& first, const Covariate& second);

/// Of their places in order (Spearman): ±1 where one rises or falls with the other, along whatever curve.
double rank_correlation(const Covariate& first, const Covariate& second);

/// The column of numbers that has one value for each of these texts, and another for each other: what goes
/// with the texts is told by it. Null where there is none.
const Covariate* number_of_texts(const Observations& observations, const Covariate& texts);

/// Whether all runs have one value, but for the rounding of what wrote it.
bool is_constant(const Covariate& covariate);

/// Numbers that differ between the runs.
bool can_be_followed(const Observations& observations, const Covariate& covariate);

/// Of a column's variance in `rows`, the share that is no cubic of these conditions, all in deviations from
/// the groups' means; column and conditions have an entry for each of `rows`. 0 where the column does not
/// vary.
double share_beside_cubics(const Observations& observations, const std::vector<int>& rows,
                           const std::vector<Eigen::VectorXd>& conditions, const Eigen::VectorXd& column);

/// Whether a cubic of one condition leaves next to nothing of another within the groups: beside each other,
/// curves over the two could have any size. Of those that have a value for each row, not for each rotor.
bool all_but_tells(const Observations& observations, const std::vector<int>& rows,
                   const Eigen::VectorXd& condition, const Eigen::VectorXd& other);

/// How many of the values that a rotor has in `rows` (−1: all of them) are at least a hundredth of the range
/// apart: four speeds that scatter a little are four, and between them a wave has any height.
int places_on_range(const Covariate& covariate, const std::vector<int>& rows, int rotor);

/// How many values `rows` have; of the first channel.
int different_values(const Covariate& covariate, const std::vector<int>& rows);

/// Where nearly all of `rows` have one of few values: these, the most common first; nothing elsewhere.
std::vector<double> levels_of(const Observations& observations, const Covariate& covariate,
                              const std::vector<int>& rows);

/// The widest part of a rotor's range of values (−1: that of all) without one in it, over that range.
double widest_gap(const Covariate& covariate, const std::vector<int>& rows, int rotor);

}  // namespace tunnelrig
