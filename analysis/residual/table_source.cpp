#include "analysis/residual/table_source.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

namespace tunnelrig {

using Eigen::Index;

double TableSource::cell(Index r, const std::string& column) const {
  return table.sheet.number(rows[static_cast<std::size_t>(r)], column)
      .value_or(std::numeric_limits<double>::quiet_NaN());
}

double TableSource::converted(Index r, const TableColumn& column) const {
  const double mechanical = column.column == table.schema.speed_column ? table.schema.speed_factor : 1;
  return column.converted(cell(r, column.column)) * mechanical;
}

std::vector<double> TableSource::numbers(const std::string& column) const {
  std::vector<double> result;
  for (const std::size_t row : rows) result.push_back(table.sheet.require_number(row, column));
  return result;
}

std::vector<std::string> TableSource::texts(const std::string& column) const {
  std::vector<std::string> result;
  for (const std::size_t row : rows) result.push_back(table.sheet.text(row, column));
  return result;
}

bool is_own_response(const TableSchema& schema, const ObservationChoice& choice) {
  return choice.response.empty() || choice.response == schema.response.column;
}

bool is_reduced(const ObservationTable& table, const ObservationChoice& choice) {
  const TableSchema& schema = table.schema;
  return is_own_response(schema, choice) && schema.response.meaning == "thrust_N" &&
         choice.baseline.empty() && (schema.diameter_column || schema.diameter_m) &&
         std::ranges::any_of(table.rows,
                             [](const Observation& row) { return row.speed_rpm.value_or(0) > 0; });
}

TableSource used_rows(const ObservationTable& table, const ObservationChoice& choice, Observations& result) {
  constexpr double kAtRest = 0.05;  // of a group's highest speed
  std::map<std::string, double> highest;
  for (const Observation& row : table.rows)
    highest[row.group] = std::max(highest[row.group], row.speed_rpm.value_or(0));
  const bool reduced = is_reduced(table, choice);
  TableSource source{table, {}};
  int resting = 0, without_speed = 0, without_air = 0;
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const Observation& row = table.rows[r];
    const double fastest = highest[row.group];
    if (reduced && (!row.speed_rpm || fastest == 0))
      ++without_speed;
    else if (row.speed_rpm && fastest > 0 && *row.speed_rpm <= kAtRest * fastest)
      ++resting;
    else if (reduced && (std::isnan(row.air_temperature_C) || std::isnan(row.air_pressure_Pa)))
      ++without_air;
    else
      source.rows.push_back(r);
  }
  if (resting > 0) result.left_out.push_back(fmt::format("{} rows: the motor stood", resting));
  if (without_speed > 0)
    result.left_out.push_back(fmt::format("{} rows: no speed was read, so they have no C_T", without_speed));
  if (without_air > 0)
    result.left_out.push_back(fmt::format(
        "{} rows: the temperature or the pressure of the air is empty, so they have no C_T", without_air));
  return source;
}

}  // namespace tunnelrig
