// The names of columns of runs.csv that the suite knows.
#pragma once

#include <string_view>

namespace tunnelrig {

/// The known column whose name differs from this one in nothing but capitals ("excluded" for "Excluded");
/// empty where there is none.
std::string_view known_but_for_case(std::string_view column);

/// How spreadsheets and programs write that there is no number: "NaN", "#N/A", …
bool stands_for_no_number(std::string_view cell);

/// Whether the column says which run it is and what became of it: read as it stands, and no condition.
bool is_text_column(std::string_view column);

/// Whether the analysis makes a condition of that name from the times of the runs (docs/effects.md): a column
/// of it is not read.
bool is_made_of_times(std::string_view column);

/// The known column that holds this quantity in our unit, where the name is that of another unit or of none
/// ("air_pressure_Pa" for "air_pressure_hPa"); empty where it is no such name.
std::string_view in_our_unit(std::string_view column);

}  // namespace tunnelrig
