#include "calibration/crosstalk.h"
#include "datasets/error.h"
#include "datasets/plausible.h"
#include "datasets/units.h"

namespace tunnelrig {

CrosstalkTable read_crosstalk(const Sheet& sheet, const CrosstalkSpec& spec) {
  const std::size_t n = spec.force_columns.size();
  if (n == 0 || spec.reading_columns.size() != n) {
    throw InputError::in(sheet.file,
                         "{} force columns and {} reading columns are named; as many of each are "
                         "needed, one at least",
                         n, spec.reading_columns.size());
  }
  const Unit& unit = unit_from_name(spec.force_unit);
  if (unit.quantity != "force") {
    throw InputError::in(sheet.file, "'{}' is a unit of {}, not of force", spec.force_unit, unit.quantity);
  }
  for (const auto* names : {&spec.force_columns, &spec.reading_columns})
    for (const std::string& name : *names) sheet.require(name);
  const auto rows = static_cast<Eigen::Index>(sheet.rows.size()), columns = static_cast<Eigen::Index>(n);
  CrosstalkTable table{.file = sheet.file,
                       .axes = spec.force_columns,
                       .channels = spec.reading_columns,
                       .force_N = Eigen::MatrixXd(rows, columns),
                       .reading = Eigen::MatrixXd(rows, columns)};
  bool zero_before = true;  // the first row starts block 0, whatever it is
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    const auto i = static_cast<Eigen::Index>(row);
    for (std::size_t column = 0; column < n; ++column) {
      const auto j = static_cast<Eigen::Index>(column);
      const double most = kMostForce_N / unit.factor;
      table.force_N(i, j) = unit.convert(sheet.require_number_within(row, spec.force_columns[column], most));
      table.reading(i, j) = sheet.require_number_within(row, spec.reading_columns[column], kMostReading);
    }
    const bool zero = (table.force_N.row(i).array() == 0).all();
    const int before = table.block.empty() ? 0 : table.block.back();
    table.block.push_back(zero && !zero_before ? before + 1 : before);
    table.line.push_back(sheet.rows[row].line);
    zero_before = zero;
  }
  return table;
}

}  // namespace tunnelrig
