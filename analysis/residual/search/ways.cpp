#include "analysis/residual/search/ways.h"

#include "analysis/residual/likelihood/candidates.h"
#include "analysis/residual/likelihood/testability.h"

#include <utility>

namespace tunnelrig {

OwnEvidence::OwnEvidence(const Observations& observations, const MixedModel& baseline)
    : observations_(observations),
      baseline_(baseline),
      predicted_(predict_response(observations, {terms_of_theory(observations), {}}, baseline.rows())) {}

bool OwnEvidence::operator()(const Term& way) const {
  return baseline_.sees(respond(way, observations_, predicted_).derivative[0]);
}

std::optional<Eigen::Index> OwnEvidence::undefined(const Term& way) const {
  const Eigen::MatrixXd column = respond(way, observations_, predicted_).derivative[0][0];
  for (Eigen::Index row = 0; row < column.rows(); ++row)
    if (!column.row(row).allFinite()) return row;
  return {};
}

std::vector<Term> all_ways(const std::vector<const Effect*>& effects, const Observations& observations,
                           const std::vector<int>& rows) {
  std::vector<Term> ways;
  for (const Effect* effect : effects) {
    if (!testability(*effect, observations).ok()) continue;
    for (Term& way : ways_to_try(*effect, observations, rows)) ways.push_back(std::move(way));
  }
  return ways;
}

}  // namespace tunnelrig
