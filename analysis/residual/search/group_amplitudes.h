// An effect whose amplitude is each group's own.
#pragma once

#include "analysis/residual/likelihood/joint_fit.h"

#include <string>
#include <vector>

namespace tunnelrig {

struct GroupEstimate {
  std::string group;
  double value = 0, low = 0, high = 0;  // 95 %
};

/// Of term t of the model, from `rows`, which scatter as `variances` say; without groups that have too few of
/// them, or in which the baseline absorbs what the effect does (a moment that is always its force times one
/// arm).
std::vector<GroupEstimate> estimate_by_group(const Observations& observations, const MeanModel& model,
                                             std::size_t t, const NullFit& variances,
                                             const std::vector<int>& rows);

/// Whether no more of their intervals are outside of the physical bounds than chance makes of 95 % intervals.
bool are_within_bounds(const std::vector<GroupEstimate>& groups, const EffectParameter& amplitude);

/// What may be compared between places of a step or time constants of effects with an amplitude of each
/// group's own. Their columns are slopes of the baseline: the restricted likelihood, of what is left beside
/// it, is the larger the less these columns do, whatever they explain (Harville 1974). Without that.
double likelihood_beside_own(const Observations& observations, const NullFit& fit,
                             const std::vector<int>& rows);

/// By group; 0 where the estimates have none.
Eigen::VectorXd values_by_group(const Observations& observations,
                                const std::vector<GroupEstimate>& estimates);

/// n: what a term does on these forces, with an amplitude for each group, and its derivative by that.
struct OwnResponse {
  Eigen::VectorXd value, derivative;

  /// What it does beside amplitude · derivative.
  Eigen::VectorXd beyond(const Eigen::VectorXd& amplitude) const {
    return value - amplitude.cwiseProduct(derivative);
  }
};
OwnResponse respond_in_groups(const Term& term, const Eigen::VectorXd& amplitude,
                              const Observations& observations, const Eigen::MatrixXd& forces);

/// What such a term acts on, and with which amplitudes (of all rows, those of their groups, within bounds).
struct GroupTerm {
  Eigen::VectorXd by_group;                   // of each group; 0 where it does not say
  Eigen::VectorXd amplitude, made, acted_on;  // n
};
GroupTerm group_term(const Observations& observations, const JointFit& fit, const Forces& forces,
                     std::size_t t, const std::vector<int>& rows);

/// Of the columns of effects with amplitudes of the groups' own, which one is term t's: from 0.
Eigen::Index place_among_own(const MeanModel& model, std::size_t t);

/// The data without the column of term t.
Observations without_own(const Observations& observations, const MeanModel& model, std::size_t t);

/// Of more groups than this none is asked for what it has of its own.
inline constexpr std::size_t kMostGroups = 24;

/// The numbers of the groups that `rows` are of.
std::vector<int> groups_among(const Observations& observations, const std::vector<int>& rows);

/// A candidate's columns, each in one of `groups` alone; without those that `mixed` does not see.
std::vector<Components> columns_by_group(const Components& column, const Observations& observations,
                                         const std::vector<int>& groups, const MixedModel& mixed);

/// A joint fit where such effects do what their formulas say at the amplitudes that are found, on forces that
/// they have not changed themselves: slopes and `beyond` of the observations are set to it.
JointFit fit_in_turns(Observations& observations, const MeanModel& model, const std::vector<int>& rows);

/// The same, with another value of parameter k of term t: a step that begins at another row.
JointFit fit_with_parameter(std::size_t k, double value, Observations& observations, MeanModel model,
                            std::size_t t, const std::vector<int>& rows);

}  // namespace tunnelrig
