// What a table's response is explained as: its logarithm or itself, as C_T or as it came.
#pragma once

#include "analysis/residual/observations/table_source.h"

namespace tunnelrig {

/// Value, unit, and what is known of each row: ρ n² D⁴ where thrusts are explained as C_T. Throws InputError
/// where a row has no response.
void set_response(const TableSource& source, const ObservationChoice& choice, Observations& result);

/// Groups that pulled the other way are measured by magnitude; a response of both signs is kept as it is.
/// Thrusts that have both, or scatter alike, have an offset beside their C_T. Groups must be set.
void set_scale(const TableSource& source, bool alike, Observations& result);

/// The first row whose response has not the sign of most of its group.
std::optional<Eigen::Index> row_of_other_sign(const TableSource& source, const Observations& result);

}  // namespace tunnelrig
