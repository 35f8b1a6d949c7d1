// The rows of a table that an explanation is of, and their cells in SI.
#pragma once

#include "analysis/residual/observations/observations.h"
#include "datasets/observations.h"

#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

struct TableSource {
  const ObservationTable& table;
  std::vector<std::size_t> rows;
  /// Whether the response is a thrust that is explained as C_T: where speed and diameter are known that is
  /// what is constant, and of thrusts of both signs it is what they have beside a tare, whatever the
  /// diameter. A baseline in another column replaces it.
  bool as_c_t = false;

  Eigen::Index count() const { return static_cast<Eigen::Index>(rows.size()); }
  const Observation& row(Eigen::Index r) const { return table.rows[rows[static_cast<std::size_t>(r)]]; }
  double cell(Eigen::Index r, const std::string& column) const;  // as it is written; NaN: empty
  double converted(Eigen::Index r, const TableColumn& column) const;
  std::vector<double> numbers(const std::string& column) const;  // throws where one is empty
  std::vector<std::string> texts(const std::string& column) const;
};

/// What the schema says of a column; a pure number where it says nothing.
TableColumn described(const TableSchema& schema, const std::string& name);

/// Whether the choice is the response that the schema names.
bool is_own_response(const TableSchema& schema, const ObservationChoice& choice);

/// A cell's volts scatter alike under any load, and so does what is no rotor's and has groups of either sign
/// (`either_sign`): nothing is there at its zero. What a rotor gives scatters with its size.
bool scatters_alike(const TableSchema& schema, const ObservationChoice& choice, bool either_sign);

/// The first of `values` that has not the sign of most of its group.
std::optional<std::size_t> of_other_sign(const std::vector<double>& values,
                                         const std::vector<std::string>& group);

/// All but those of a standing motor, and where C_T is explained those without a speed; what is left out is
/// said.
TableSource used_rows(const ObservationTable& table, const ObservationChoice& choice, Observations& result);

}  // namespace tunnelrig
