// What a column of a table can mean to the suite, and what that rules out.
#pragma once

#include "datasets/units.h"

#include <optional>
#include <string>
#include <string_view>

namespace tunnelrig {

/// Throws InputError where there is no such meaning, or where the unit is of another quantity. Empty: fine.
void check_meaning(std::string_view meaning, const Unit& unit);

/// What a value cannot be for its unit and meaning ("no temperature of air; …"), or nothing. `value` is
/// converted.
std::optional<std::string> impossible(double value, const Unit& unit, std::string_view meaning);

}  // namespace tunnelrig
