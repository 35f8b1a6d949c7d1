// Columns of runs.csv and of tables that some sessions, blocks or groups have in another unit.
#pragma once

#include "datasets/observations.h"

#include <set>
#include <string>
#include <vector>

namespace tunnelrig {

/// A sentence each, naming the lines, and the columns that they are of.
struct UnitDoubts {
  std::vector<std::string> sentences;
  std::set<std::string> columns;
};

/// Columns whose name ends in a unit, session by session (another_unit.h has the rule). Excluded runs are
/// not looked at, and of tares neither forces nor speeds.
UnitDoubts unit_doubts(const Sheet& runs_sheet, const std::vector<Run>& runs);

/// Columns of which the schema says a unit, by the column of `blocks` where it is one, then by groups.
UnitDoubts unit_doubts(const ObservationTable& table);

}  // namespace tunnelrig
