// Which effects data can show, and what is known before they are asked.
#pragma once

#include "analysis/residual/likelihood/terms.h"

#include <string>
#include <vector>

namespace tunnelrig {

/// Why an effect cannot be tried on this data; empty where it can. `missing`: the covariates that it lacks.
struct Testability {
  std::vector<std::string> missing;
  std::string reason;
  bool ok() const { return missing.empty() && reason.empty(); }
};
Testability testability(const Effect& effect, const Observations& observations);

/// What an effect goes by: its covariates; for a function of the force alone what the baseline's force goes
/// by, because a bend there is as likely the law's as the cell's: the column of `linear:COLUMN` or
/// `power:COLUMN`, or the measured speed of rotors.
std::vector<std::string> own_conditions(const Effect& effect, const Observations& observations);

/// Whether one of these is a condition of both.
bool share_a_condition(const Effect& one, const Effect& other, const Observations& observations);

/// Whether that is nothing but what the law of the baseline, no cell's line, is over, be it in another unit.
/// Each group has a law of its own, and so a bend of its own over it is as likely the law's as the effect's.
bool goes_by_the_law_alone(const Effect& effect, const Observations& observations);

/// What is known whatever the data say: of a campaign whose speeds were measured, that thrust goes with their
/// square.
std::vector<Term> known_terms(const Observations& observations);

/// The same of a table, whose baseline has no speed: what is expected to be found.
std::vector<Term> terms_of_theory(const Observations& observations);

}  // namespace tunnelrig
