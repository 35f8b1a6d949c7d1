// Units that tables of other people arrive in, and their factors to SI.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// value_SI = value · factor + offset. Rotation speed is kept in rev/min, temperature in °C, as the campaign
/// folder has them; everything else is SI.
struct Unit {
  std::string_view name;
  std::string_view quantity;  // "force", "speed", "temperature", …
  double factor = 1;
  double offset = 0;

  double convert(double value) const { return value * factor + offset; }
};

/// Of a column that holds no numbers: which battery, whose blades.
inline constexpr std::string_view kTextUnit = "text";

/// Of a column of dates, which is kept in days since its earliest (table_dates.h).
inline constexpr std::string_view kDateUnit = "date";

/// The unit of that name ("gf", "rpm", "in", "degC", "%", …); throws InputError listing what is known.
const Unit& unit_from_name(std::string_view name);

/// The unit that values of this one are in once converted: "N" for "gf", "1" for "%".
std::string_view unit_after_conversion(std::string_view name);

/// The unit that a column's name ends in: "mm" for "cable_mm"; empty where it ends in none.
std::string_view unit_in_ending(std::string_view column);

/// "Thrust (gf)" → "gf"; empty where the header carries no unit in parentheses.
std::string_view unit_in_header(std::string_view header);

}  // namespace tunnelrig
