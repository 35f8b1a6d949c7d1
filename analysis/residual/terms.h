// Terms of a model: a candidate effect in one of the ways in which it can act, and what it does to each run.
#pragma once

#include "analysis/effects/effect.h"
#include "analysis/residual/observations.h"

#include <string>
#include <vector>

namespace tunnelrig {

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

/// What a term adds to y, and the derivative by each of its parameters.
struct TermResponse {
  Components value;
  std::vector<Components> derivative;  // of each parameter; empty for change-points
};

/// Evaluates a term at its parameters, the forces being those that the rest of the model predicts (n × c, in
/// the response's unit). Regressors come from predictions, never from measured responses.
TermResponse respond(const Term& term, const Observations& observations, const Eigen::MatrixXd& predicted);

/// Why an effect cannot be tried on this data; empty where it can. `missing`: the covariates that it lacks.
struct Testability {
  std::vector<std::string> missing;
  std::string reason;
  bool ok() const { return missing.empty() && reason.empty(); }
};
Testability testability(const Effect& effect, const Observations& observations);

/// What an effect goes by: its covariates; with `linear:COLUMN` or `power:COLUMN` that column for a function
/// of the force alone, because a bend there is as likely the law's as the cell's.
std::vector<std::string> own_conditions(const Effect& effect, const Observations& observations);

/// What is known whatever the data say: of a campaign whose speeds were measured, that thrust goes with their
/// square.
std::vector<Term> known_terms(const Observations& observations);

/// The same of a table, whose baseline has no speed: what is expected to be found.
std::vector<Term> terms_of_theory(const Observations& observations);

/// Blocks that a step leaves on either side.
inline constexpr int kLeastBlocksBesideAStep = 3;
inline constexpr double kLeastShareBesideAStep = 0.05;  // of the runs: the ends of a long course are no step

/// All ways to try an effect: rotors, shapes on their grids, change-points with three blocks of `rows` on
/// each side.
std::vector<Term> ways_to_try(const Effect& effect, const Observations& observations,
                              const std::vector<int>& rows);

/// Typical values of an effect's covariates.
std::vector<double> reference_of(const Effect& effect, const Observations& observations);

}  // namespace tunnelrig
