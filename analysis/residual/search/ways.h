// What can be tried, and what of it the runs can show.
#pragma once

#include "analysis/residual/likelihood/joint_fit.h"

#include <optional>
#include <vector>

namespace tunnelrig {

/// Candidates that can be tried, each in all its ways.
std::vector<Term> all_ways(const std::vector<const Effect*>& effects, const Observations& observations,
                           const std::vector<int>& rows);

/// Whether a way would change the forces that the baseline and what is known predict, by more than the
/// baseline can absorb. What only another effect's changes of the force would show is no evidence of its own.
class OwnEvidence {
 public:
  /// Keeps references. `baseline`: alone, of the runs that count.
  OwnEvidence(const Observations& observations, const MixedModel& baseline);
  bool operator()(const Term& way) const;
  /// The first row in which the way has no finite value: a logarithm of zero, for example.
  std::optional<Eigen::Index> undefined(const Term& way) const;

 private:
  const Observations& observations_;
  const MixedModel& baseline_;
  Eigen::MatrixXd predicted_;
};

}  // namespace tunnelrig
