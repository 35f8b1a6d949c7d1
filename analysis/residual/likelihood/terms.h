// Terms of a model: an effect in one of the ways in which it can act, and what it does to each run.
#pragma once

#include "analysis/effects/effect.h"
#include "analysis/residual/observations/observations.h"

#include <string>
#include <vector>

namespace tunnelrig {

/// Times within a run at which an effect that changes with time is evaluated.
inline constexpr int kTimesWithinRun = 32;

/// An effect on all rotors or on one, with its shape parameters set.
struct Term {
  const Effect* effect = nullptr;
  int rotor = -1;                  // from 0; −1: all alike
  int other = -1;                  // crosstalk: the rotor that leaks in
  bool per_group = false;          // its amplitude is each group's own (tables)
  bool at_theory = false;          // its amplitude is known physics, not fitted
  std::vector<double> parameters;  // all of the effect's; the amplitude is 0 until it was fitted

  /// "creep of rotor 2"
  std::string label() const;
  bool same_way(const Term& term) const;  // same effect, form, rotor: only its shape may differ
};

/// Places of the terms, the first to act first: by stage, and as they were adopted. An amplitude of each
/// group's own is a part of the baseline.
std::vector<std::size_t> order_of_action(const std::vector<Term>& terms);

/// A quantity in every component of the response: the runs' means (n × c), then each cosine coefficient of
/// their course.
using Components = std::vector<Eigen::MatrixXd>;

/// As `MixedModel::stack` takes them; they are those of `columns`.
std::vector<const Components*> pointers_to(const std::vector<Components>& columns);

/// What a term adds to y, and the derivative by each of its parameters.
struct TermResponse {
  Components value;
  std::vector<Components> derivative;  // of each parameter; empty for change-points
};

/// Evaluates a term at its parameters, the forces being those that the rest of the model predicts (n × c, in
/// the response's unit). Regressors come from predictions, never from measured responses.
TermResponse respond(const Term& term, const Observations& observations, const Eigen::MatrixXd& predicted);

/// The same, at an amplitude of each row's own.
TermResponse respond(const Term& term, const Eigen::VectorXd& amplitude, const Observations& observations,
                     const Eigen::MatrixXd& predicted);

/// Typical values of an effect's covariates.
std::vector<double> reference_of(const Effect& effect, const Observations& observations);

}  // namespace tunnelrig
