#include "analysis/residual/observations/table_source.h"

#include "analysis/resting_speed.h"
#include "datasets/error.h"
#include "datasets/first_few.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

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

TableColumn described(const TableSchema& schema, const std::string& name) {
  for (const TableColumn& column : schema.covariates)
    if (column.column == name) return column;
  return {.column = name, .unit = "1", .meaning = ""};
}

bool is_own_response(const TableSchema& schema, const ObservationChoice& choice) {
  return choice.response.empty() || choice.response == schema.response.column;
}

bool scatters_alike(const TableSchema& schema, const ObservationChoice& choice, bool either_sign) {
  if (choice.baseline.starts_with("power:")) return false;
  if (!is_own_response(schema, choice)) return either_sign;
  if (!schema.scatter.empty()) return schema.scatter == "absolute";
  if (schema.response.meaning.empty() && either_sign) return true;
  return unit_from_name(schema.response.unit).quantity == "voltage";
}

std::optional<std::size_t> of_other_sign(const std::vector<double>& values,
                                         const std::vector<std::string>& group) {
  std::map<std::string, int> sign;
  for (std::size_t r = 0; r < values.size(); ++r) sign[group[r]] += values[r] > 0 ? 1 : -1;
  for (std::size_t r = 0; r < values.size(); ++r)
    if (values[r] * sign[group[r]] <= 0) return r;
  return {};
}

namespace {

constexpr std::size_t kNamedRows = 4;

bool is_thrust_with_speed(const ObservationTable& table, const ObservationChoice& choice) {
  return is_own_response(table.schema, choice) && table.schema.response.meaning == "thrust_N" &&
         (choice.baseline.empty() || choice.baseline == kConstantBaseline) &&
         std::ranges::any_of(table.rows,
                             [](const Observation& row) { return row.speed_rpm.value_or(0) > 0; });
}

/// Of thrusts without a diameter: whether they have both signs or scatter alike, and most have a speed.
bool have_a_tare(const ObservationTable& table, const ObservationChoice& choice,
                 const std::vector<std::size_t>& rows) {
  std::vector<double> thrust_N;
  std::vector<std::string> group;
  std::size_t with_speed = 0;
  for (const std::size_t r : rows) {
    thrust_N.push_back(table.rows[r].response);
    group.push_back(table.rows[r].group);
    with_speed += table.rows[r].speed_rpm.value_or(0) > 0 ? 1U : 0U;
  }
  return 2 * with_speed > rows.size() &&
         (scatters_alike(table.schema, choice, false) || of_other_sign(thrust_N, group));
}

/// Leaves out rows for which `is_out` holds, and says which.
template <class Rule>
void leave_out(TableSource& source, const std::string& why, Observations& result, const Rule& is_out) {
  std::vector<std::string> out;
  std::erase_if(source.rows, [&](std::size_t r) {
    const bool goes = is_out(source.table.rows[r]);
    if (goes) out.push_back(source.table.rows[r].place);
    return goes;
  });
  if (out.empty()) return;
  result.left_out.push_back(fmt::format("{} {} left out: {}, {}", out.size(),
                                        out.size() == 1 ? "row" : "rows", why, first_few(out, kNamedRows)));
}

/// A motor at rest has no thrust: what says otherwise, in words.
template <class Rule>
std::string load_at_rest(const TableSource& source, const Rule& is_at_rest) {
  constexpr double kLoaded = 0.25;  // of the largest response
  double most = 0, most_at_rest = 0;
  for (const std::size_t r : source.rows) {
    double& larger = is_at_rest(source.table.rows[r]) ? most_at_rest : most;
    larger = std::max(larger, std::abs(source.table.rows[r].response));
  }
  return most_at_rest > kLoaded * most ? fmt::format("; {} is up to {:.3g} there: another unit?",
                                                     source.table.schema.response.column, most_at_rest)
                                       : "";
}

/// A speed that a few rows lack would be no condition at all.
void leave_out_few_without_speed(TableSource& source, Observations& result) {
  constexpr std::ptrdiff_t kOneOf = 10;
  const auto lacks = [](const Observation& row) { return !row.speed_rpm; };
  const auto without = std::count_if(source.rows.begin(), source.rows.end(),
                                     [&](std::size_t r) { return lacks(source.table.rows[r]); });
  if (kOneOf * without <= std::ssize(source.rows))
    leave_out(source, "no speed was read, as in all others", result, lacks);
}

/// Rows that stand twice count as two measurements.
void say_duplicates(const TableSource& source, Observations& result) {
  constexpr std::size_t kOneOf = 20;
  std::map<std::vector<std::string>, std::size_t> first;
  std::vector<std::string> again;
  for (const std::size_t r : source.rows)
    if (!first.emplace(source.table.sheet.rows[r].cells, r).second)
      again.push_back(source.table.rows[r].place);
  if (again.empty() || again.size() * kOneOf < source.rows.size()) return;
  result.left_out.push_back(fmt::format(
      "{} {} the same in every column as another, and count as measured anew: if they were entered "
      "twice, every p is too small, {}",
      again.size(), again.size() == 1 ? "row is" : "rows are", first_few(again, kNamedRows)));
}

}  // namespace

TableSource used_rows(const ObservationTable& table, const ObservationChoice& choice, Observations& result) {
  TableSource source{table, std::vector<std::size_t>(table.rows.size())};
  std::iota(source.rows.begin(), source.rows.end(), 0U);
  const std::map<std::string, double> at_rest = resting_speeds_rpm(table);
  const auto rests = [&](const Observation& row) {
    const double rest_rpm = at_rest.at(row.group);
    return row.speed_rpm && rest_rpm > 0 && *row.speed_rpm <= rest_rpm;
  };
  leave_out(source,
            "the motor stood or its speed was not read (at most 5 % of what its group runs at)" +
                load_at_rest(source, rests),
            result, rests);
  const bool diameter = table.schema.diameter_column || table.schema.diameter_m;
  const bool thrust_with_speed = is_thrust_with_speed(table, choice);
  source.as_c_t = thrust_with_speed && (diameter || have_a_tare(table, choice, source.rows));
  if (source.as_c_t) {
    leave_out(source, "no speed was read, so there is no C_T", result,
              [&](const Observation& row) { return !row.speed_rpm || at_rest.at(row.group) == 0; });
    leave_out(source, "the temperature or the pressure of the air is empty, so there is no C_T", result,
              [](const Observation& row) {
                return std::isnan(row.air_temperature_C) || std::isnan(row.air_pressure_Pa);
              });
  } else if (thrust_with_speed) {
    leave_out_few_without_speed(source, result);
  }
  if (source.rows.empty())
    throw InputError(fmt::format("{}: no row is left to explain: {}", table.schema.name,
                                 fmt::join(result.left_out, "; ")));
  say_duplicates(source, result);
  return source;
}

}  // namespace tunnelrig
