#include "analysis/residual/table_source.h"

#include "analysis/resting_speed.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

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

namespace {

/// Their places, as many as anybody reads.
std::string first_few(const std::vector<std::string>& rows) {
  constexpr std::size_t kNamed = 4;
  const auto end = rows.begin() + static_cast<std::ptrdiff_t>(std::min(rows.size(), kNamed));
  return fmt::format(", {}{}", fmt::join(rows.begin(), end, ", "), rows.size() > kNamed ? " …" : "");
}

}  // namespace

TableSource used_rows(const ObservationTable& table, const ObservationChoice& choice, Observations& result) {
  const std::map<std::string, double> at_rest = resting_speeds_rpm(table);
  const bool reduced = is_reduced(table, choice);
  TableSource source{table, {}};
  std::vector<std::string> resting, without_speed, without_air;
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const Observation& row = table.rows[r];
    const double rest_rpm = at_rest.at(row.group);
    if (reduced && (!row.speed_rpm || rest_rpm == 0))
      without_speed.push_back(row.place);
    else if (row.speed_rpm && rest_rpm > 0 && *row.speed_rpm <= rest_rpm)
      resting.push_back(row.place);
    else if (reduced && (std::isnan(row.air_temperature_C) || std::isnan(row.air_pressure_Pa)))
      without_air.push_back(row.place);
    else
      source.rows.push_back(r);
  }
  const auto say = [&](const std::vector<std::string>& rows, const char* why) {
    if (rows.empty()) return;
    result.left_out.push_back(fmt::format("{} {}: {}", rows.size(), rows.size() == 1 ? "row" : "rows", why) +
                              first_few(rows));
  };
  say(resting, "the motor stood or its speed was not read (at most 5 % of what its group runs at)");
  say(without_speed, "no speed was read, so there is no C_T");
  say(without_air, "the temperature or the pressure of the air is empty, so there is no C_T");
  return source;
}

}  // namespace tunnelrig
