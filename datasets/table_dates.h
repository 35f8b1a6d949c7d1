// Columns of dates in tables of observations.
#pragma once

#include "datasets/csv.h"
#include "datasets/observations.h"

namespace tunnelrig {

/// The sheet with days since the column's earliest date, in digits, for each cell of a column of unit "date".
/// Throws InputError naming file, line and column of a cell that is no date (ISO 8601, with or without a
/// time).
Sheet with_days_for_dates(Sheet sheet, const TableSchema& schema);

}  // namespace tunnelrig
