#include "analysis/residual/observations/table_response.h"

#include "analysis/air.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void set_response(const TableSource& source, const ObservationChoice& choice, Observations& result) {
  const TableSchema& schema = source.table.schema;
  const bool own = is_own_response(schema, choice);
  const TableColumn column = own ? schema.response : described(schema, choice.response);
  result.response = column.column;
  source.table.sheet.require(column.column);
  result.unit = unit_after_conversion(column.unit);
  result.coefficient = own && column.meaning.starts_with("c_t");
  const MatrixXd ones = MatrixXd::Ones(source.count(), 1);
  result.value = result.known = ones;
  const bool reduced = source.as_c_t;
  result.coefficient = result.coefficient || reduced;
  const std::string_view quantity = unit_from_name(column.unit).quantity;
  result.of_air = own && !reduced && (!column.meaning.empty() || quantity == "power" || quantity == "torque");
  constexpr std::array<std::string_view, 8> kOfNoCell = {"number", "time",     "frequency",   "length",
                                                         "area",   "velocity", "temperature", "angle"};
  result.of_no_cell =
      std::ranges::count(kOfNoCell, quantity) > 0 && column.unit != "counts" && column.meaning.empty();
  for (Index r = 0; r < source.count(); ++r) {
    const Observation& row = source.row(r);
    result.value(r, 0) = source.converted(r, column);
    if (std::isnan(result.value(r, 0)))
      throw InputError::in(row.place, "the response {} is empty", result.response);
    if (std::abs(result.value(r, 0)) > kLargestResponse)
      throw InputError::in(row.place, "the response {} is {:g}, beyond ±{:g}", result.response,
                           result.value(r, 0), kLargestResponse);
    if (!reduced) continue;
    const double density = dry_air_density_kg_m3(row.air_pressure_Pa, row.air_temperature_C + kZeroCelsius_K);
    result.known(r, 0) = density * std::pow(*row.speed_rpm / 60, 2) *
                         std::pow(row.diameter_m.value_or(1), 4);  // T = C_T ρ n² D⁴
  }
}

std::optional<Index> row_of_other_sign(const TableSource& source, const Observations& result) {
  std::vector<std::string> group;
  for (Index r = 0; r < source.count(); ++r) group.push_back(source.row(r).group);
  const auto row =
      of_other_sign(std::vector<double>(result.value.data(), result.value.data() + source.count()), group);
  return row ? std::optional<Index>(static_cast<Index>(*row)) : std::nullopt;
}

namespace {

/// What is left of y beside a constant and a slope over x.
double rest_beside(const VectorXd& x, const VectorXd& y) {
  const VectorXd from_mean = x.array() - x.mean(), rest = y.array() - y.mean();
  const double squares = from_mean.squaredNorm();
  const double slope = squares > 0 ? from_mean.dot(rest) / squares : 0;
  return (rest - slope * from_mean).squaredNorm();
}

/// The others: a speed twice as high as those of nine rows in ten is an error, and would decide alone.
std::vector<Index> without_wild_speeds(const VectorXd& squares, const std::vector<Index>& rows) {
  constexpr double kTwice = 4;  // of its square
  std::vector<double> sorted(squares.begin(), squares.end());
  const auto high = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 9 / 10);
  std::nth_element(sorted.begin(), high, sorted.end());
  std::vector<Index> result;
  for (Index r = 0; r < squares.size(); ++r)
    if (squares(r) <= kTwice * *high) result.push_back(rows[static_cast<std::size_t>(r)]);
  return result;
}

/// A tachometer does not see the direction, a thrust of both directions does: n|n| in place of n² where a
/// group's thrusts follow that.
void turn_reversed(const VectorXd& thrust_N, Observations& result) {
  constexpr double kClearly = 0.5;
  constexpr Index kOneOf = 10;  // fewer are errors
  std::vector<std::string> reversed;
  for (const auto& [group, rows] : places_of_each(result.group)) {
    const std::vector<Index> sound = without_wild_speeds(result.known(rows, 0), rows);
    const VectorXd y = thrust_N(sound), known = result.known(sound, 0);
    const VectorXd directed = known.array() * y.array().sign();
    const Index forward = (y.array() > 0).count();
    if (kOneOf * std::min(forward, y.size() - forward) < y.size()) continue;
    if (!(rest_beside(directed, y) < kClearly * rest_beside(known, y))) continue;
    result.known(rows, 0).array() *= thrust_N(rows).array().sign();
    reversed.push_back(result.group_name[static_cast<std::size_t>(group)]);
  }
  if (!reversed.empty())
    result.left_out.push_back(
        fmt::format("thrusts of both directions{}: C_T is of n|n|, whose sign is the thrust's",
                    result.groups() > 1 ? fmt::format(" ({})", fmt::join(reversed, ", ")) : ""));
}

}  // namespace

void set_scale(const TableSource& source, bool alike, Observations& result) {
  result.multiplicative = !alike && !row_of_other_sign(source, result);
  if (result.multiplicative) {
    result.sign = result.value.array().sign();
    result.value = result.value.cwiseAbs();
    result.y = (result.value.array() / result.known.array()).log();
  } else {
    result.y = result.value;
    if (source.as_c_t) {
      turn_reversed(result.value.col(0), result);
      result.slopes = result.known;
    }
    result.known.setOnes();
  }
}

}  // namespace tunnelrig
