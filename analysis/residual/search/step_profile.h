// Where a step lies: the likelihood of each row at which it may begin.
#pragma once

#include "analysis/residual/likelihood/candidates.h"
#include "analysis/residual/likelihood/joint_fit.h"

#include <vector>

namespace tunnelrig {

/// Half the likelihood ratio that 95 % of changes of the mean stay below at the row where they are, small
/// ones before long stretches of rows: (1 − exp(−x/2))² = 0.95 (Yao, Ann. Stat. 15, 1987; Hansen,
/// Econometrica 68, 2000).
inline constexpr double kStepInterval = 3.676;

/// Rows around the likeliest, ascending, up to where the step is clearly not.
struct StepProfile {
  std::vector<int> first_row;
  std::vector<double> log_likelihood;  // beside the model without the step

  bool empty() const { return first_row.empty(); }
  int likeliest() const;
  int lowest() const { return end_of_interval(false); }
  int highest() const { return end_of_interval(true); }

 private:
  int end_of_interval(bool highest) const;
};

/// Of term t of a model, whose change-point is at a row that was found, by these rows; it begins at one of
/// `possible`. The rest of the model is linear about its parameters, all amplitudes and variances are fitted
/// anew. Empty where no row is possible.
StepProfile step_profile(const Observations& observations, const MeanModel& model, std::size_t t,
                         const std::vector<int>& rows, const std::vector<int>& possible);

/// The row from which a term that is a step is there.
int first_row_of(const Term& step);

}  // namespace tunnelrig
