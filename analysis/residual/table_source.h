// The rows of a table that an explanation is of, and their cells in SI.
#pragma once

#include "analysis/residual/observations.h"
#include "datasets/observations.h"

#include <string>
#include <vector>

namespace tunnelrig {

struct TableSource {
  const ObservationTable& table;
  std::vector<std::size_t> rows;

  Eigen::Index count() const { return static_cast<Eigen::Index>(rows.size()); }
  const Observation& row(Eigen::Index r) const { return table.rows[rows[static_cast<std::size_t>(r)]]; }
  double cell(Eigen::Index r, const std::string& column) const;  // as it is written; NaN: empty
  double converted(Eigen::Index r, const TableColumn& column) const;
  std::vector<double> numbers(const std::string& column) const;  // throws where one is empty
  std::vector<std::string> texts(const std::string& column) const;
};

/// Whether the choice is the response that the schema names.
bool is_own_response(const TableSchema& schema, const ObservationChoice& choice);

/// Whether a thrust is explained as C_T: where speed and diameter are known that is what is constant. A
/// baseline in another column replaces it.
bool is_reduced(const ObservationTable& table, const ObservationChoice& choice);

/// All but those of a standing motor, and where C_T is explained those without a speed; what is left out is
/// said.
TableSource used_rows(const ObservationTable& table, const ObservationChoice& choice, Observations& result);

}  // namespace tunnelrig
