// The explanation for machines and for people.
#pragma once

#include "analysis/residual/explanation/explanation.h"

#include <string>

namespace tunnelrig {

/// "tunnelrig-explain/1"; field names are a contract (docs/closed-loop.md). Every number is finite.
std::string explanation_json(const Explanation& explanation);

/// Plain text, what a person reads on a terminal.
std::string explanation_text(const Explanation& explanation);

/// "There is structure, but …": what the verdict means, and whether the sealed blocks bear it out.
std::string verdict_in_words(const Explanation& explanation);

/// Every candidate with formula, parameters, what it needs, and whether these data can test it (null: no
/// data).
std::string candidates_text(const std::vector<const Effect*>& effects, const CanBeFound* can_be_found);
std::string candidates_json(const std::vector<const Effect*>& effects, const CanBeFound* can_be_found);

}  // namespace tunnelrig
