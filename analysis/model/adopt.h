// From an explanation to a version of the model.
#pragma once

#include "analysis/model/model_version.h"
#include "analysis/residual/explanation/explanation.h"

#include <optional>

namespace tunnelrig {

/// What was adopted, and what could not be, in words.
struct Adoption {
  std::optional<ModelVersion> model;  // without a number yet; nothing where there is nothing to adopt
  std::vector<std::string> notes;
};

/// Whether a model can correct the response: the thrusts of a campaign.
bool adoptable(const Observations& observations);

/// Throws InputError unless the explanation is of a campaign's thrusts, which are what a model corrects; for
/// what is asked of `adopt`, before hours are spent on an explanation.
void require_adoptable(const Observations& observations);

/// The accepted effects, and with `empirical` the curves that have no name. Standard errors, and what
/// parameters of one effect share, are the explanation's jackknife's; correlations between effects those of
/// the linearised joint fit; what theory gives has none.
Adoption adopt(const Observations& observations, const Explanation& explanation, bool empirical);

}  // namespace tunnelrig
