// The explanation as a page for people.
#pragma once

#include "analysis/residual/explanation/explanation.h"

#include <string>

namespace tunnelrig {

/// Where a page comes from.
struct PageOrigin {
  std::string db, program_version, arguments, created_utc;
};

/// One self-contained page: residuals against covariates before and after, the ranking, null distributions.
std::string explanation_html(const Explanation& explanation, const Observations& observations,
                             const SearchSettings& settings, const PageOrigin& origin);

}  // namespace tunnelrig
