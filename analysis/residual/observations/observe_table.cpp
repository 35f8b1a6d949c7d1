#include "analysis/expression.h"
#include "analysis/residual/observations/observations.h"
#include "analysis/residual/observations/parts_of_equal_size.h"
#include "analysis/residual/observations/table_response.h"
#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A covariate's name: what it means where the schema says so, else its column.
void add_covariates(const TableSource& source, Observations& result) {
  const TableSchema& schema = source.table.schema;
  const auto add = [&](const std::string& name, std::string_view unit, const auto& value_of,
                       bool derived = false) {
    if (result.find(name) != nullptr) return;
    Covariate covariate{name, MatrixXd(source.count(), 1), derived, std::string(unit)};
    Index missing = 0;
    for (Index r = 0; r < source.count(); ++r) {
      covariate.value(r, 0) = value_of(r);
      if (std::isnan(covariate.value(r, 0))) ++missing;
    }
    if (missing == source.count()) return;
    if (missing > 0 && !may_be_absent(name))
      result.not_usable[name] = fmt::format("missing in {} of {} rows", missing, source.count());
    result.covariates.push_back(std::move(covariate));
  };
  for (const TableColumn& column : schema.covariates)
    if (column.unit == kTextUnit)
      result.covariates.push_back(covariate_of_texts(column.column, source.texts(column.column)));
    else if (column.column != result.response)  // which would explain itself
      add(column.name(), column.kept_unit(), [&](Index r) { return source.converted(r, column); });
  if (schema.diameter_column || schema.diameter_m)
    add(
        std::string(kDiameter), "m", [&](Index r) { return source.row(r).diameter_m.value_or(kNaN); },
        !schema.diameter_column);
  if (result.find("air_temperature_C") == nullptr) result.assumed.insert("air_temperature_C");
  add("air_temperature_C", "°C", [&](Index r) { return source.row(r).air_temperature_C; });
}

/// Of each row in use, where all have one.
std::optional<std::vector<double>> run_orders(const TableSource& source) {
  for (const TableColumn& column : source.table.schema.covariates) {
    if (column.name() != "run_order") continue;
    std::vector<double> result;
    for (const std::size_t row : source.rows) {
      const auto value = source.table.sheet.number(row, column.column);
      if (!value) return {};
      result.push_back(*value);
    }
    return result;
  }
  return {};
}

/// Whether numbers of several groups or blocks are the same, and fall nowhere but from one to the next.
bool is_counted_anew(const TableSource& source, const std::vector<double>& order) {
  const TableSchema& schema = source.table.schema;
  const bool named_blocks = !schema.bins && schema.blocks != "rows";
  std::vector<std::pair<std::string, std::string>> owner;  // group and block
  for (Index r = 0; r < source.count(); ++r)
    owner.emplace_back(
        source.row(r).group,
        named_blocks ? source.table.sheet.text(source.rows[static_cast<std::size_t>(r)], schema.blocks) : "");
  std::map<double, std::size_t> last;
  bool shared = false, falls = false;
  for (std::size_t r = 0; r < order.size(); ++r) {
    const auto [seen, fresh] = last.emplace(order[r], r);
    shared |= !fresh && owner[seen->second] != owner[r];
    if (r == 0 || order[r] >= order[r - 1]) continue;
    if (owner[r] == owner[r - 1]) return false;
    falls = true;
  }
  return shared && falls;
}

/// By run_order: steps and what depends on the row before go by place.
void sort_by_order(TableSource& source, Observations& result) {
  const auto order = run_orders(source);
  if (!order) return;
  if (is_counted_anew(source, *order)) {
    result.left_out.emplace_back(
        "run_order is counted anew in each group or block: rows are taken to follow each other as in the "
        "file; where those of one number were read at one time, sort the file by it");
    return;
  }
  std::vector<std::size_t> place(order->size());
  std::iota(place.begin(), place.end(), 0U);
  std::ranges::stable_sort(place, {}, [&](std::size_t r) { return (*order)[r]; });
  std::vector<std::size_t> sorted;
  for (const std::size_t r : place) sorted.push_back(source.rows[r]);
  source.rows = std::move(sorted);
}

int index_in(std::map<std::string, int>& known, std::vector<std::string>& names, const std::string& name) {
  const auto [found, fresh] = known.emplace(name, static_cast<int>(names.size()));
  if (fresh) names.push_back(name);
  return found->second;
}

/// Does what a key of the schema asks for; what goes wrong is put down to that key.
template <class Work>
void as_schema_says(const TableSchema& schema, int line, const std::string& key, const std::string& value,
                    const Work& work) {
  try {
    work();
  } catch (const InputError& error) {
    throw InputError::at(schema.file, line, "{} = \"{}\": {}", key, value, error.what());
  }
}

void set_blocks(const TableSource& source, Observations& result) {
  const TableSchema& schema = source.table.schema;
  if (schema.bins) {
    as_schema_says(schema, schema.blocks_line, "blocks", schema.blocks, [&] {
      result.block = parts_of_equal_size(source.numbers(schema.bins->column), schema.bins->count);
    });
    const int count = *std::max_element(result.block.begin(), result.block.end()) + 1;
    for (int b = 0; b < count; ++b)
      result.block_name.push_back(fmt::format("{} {}", schema.bins->column, b + 1));
    return;
  }
  std::map<std::string, int> known;
  result.blocks_are_rows = schema.blocks == "rows";
  for (Index r = 0; r < source.count(); ++r) {
    const std::size_t sheet_row = source.rows[static_cast<std::size_t>(r)];
    const std::string name =
        result.blocks_are_rows ? std::to_string(r) : source.table.sheet.text(sheet_row, schema.blocks);
    result.block.push_back(index_in(known, result.block_name, name));
  }
}

void set_belonging(const TableSource& source, Observations& result) {
  std::map<std::string, int> known;
  for (Index r = 0; r < source.count(); ++r) {
    result.group.push_back(index_in(known, result.group_name, source.row(r).group));
    result.name.push_back(source.row(r).place);
  }
  set_blocks(source, result);
  result.in_tunnel.assign(result.group.size(), false);
  result.previous.assign(result.group.size(), -1);
}

/// Place of a row's value within its group, 0 to 1; NaN where the cell is empty.
VectorXd ranks(const TableSource& source, const Observations& result, const std::string& column) {
  std::vector<double> rank(result.group.size(), std::numeric_limits<double>::quiet_NaN());
  for (auto& [group, rows] : places_of_each(result.group)) {
    std::erase_if(rows, [&](Index r) { return std::isnan(source.cell(r, column)); });
    std::stable_sort(rows.begin(), rows.end(),
                     [&](Index a, Index b) { return source.cell(a, column) < source.cell(b, column); });
    for (std::size_t k = 0; k < rows.size(); ++k)
      rank[static_cast<std::size_t>(rows[k])] =
          (static_cast<double>(k) + 0.5) / static_cast<double>(rows.size());
  }
  return Eigen::Map<const VectorXd>(rank.data(), source.count());
}

std::vector<bool> held_out_rows(const TableSource& source, const Observations& result,
                                const Expression& expression) {
  std::vector<VectorXd> columns;
  for (const std::string& name : expression.names()) {
    const bool rank = name.starts_with("rank(");
    const std::string column = rank ? name.substr(5, name.size() - 6) : name;
    source.table.sheet.require(column);
    VectorXd values(source.count());
    for (Index r = 0; r < source.count(); ++r) values(r) = source.cell(r, column);
    columns.push_back(rank ? ranks(source, result, column) : values);
  }
  std::vector<double> values(columns.size());
  std::vector<bool> held_out;
  for (Index r = 0; r < source.count(); ++r) {
    for (std::size_t k = 0; k < columns.size(); ++k) {
      values[k] = columns[k](r);
      if (std::isnan(values[k]))
        throw InputError::in(source.row(r).place, "{} is empty here, so hold_out is neither true nor false",
                             expression.names()[k]);
    }
    const double held = expression(values);
    if (held != 0 && held != 1)
      throw InputError::in(source.row(r).place,
                           "this is {:g} here, neither true nor false; write a comparison", held);
    held_out.push_back(held != 0);
  }
  if (const auto n = std::count(held_out.begin(), held_out.end(), true); n == 0 || n == source.count())
    throw InputError("this takes all rows or none");
  return held_out;
}

void set_hold_out(const TableSource& source, Observations& result) {
  const TableSchema& schema = source.table.schema;
  if (schema.hold_out.empty()) return;
  const Expression expression(schema.hold_out,
                              fmt::format("{}:{}: hold_out", schema.file, schema.hold_out_line));
  as_schema_says(schema, schema.hold_out_line, "hold_out", schema.hold_out,
                 [&] { result.held_out = held_out_rows(source, result, expression); });
}

/// A baseline of its own for each row leaves nothing to compare.
void check_groups(const TableSchema& schema, const Observations& result) {
  if (schema.groups.empty() || result.group_name.size() < result.group.size()) return;
  throw InputError::at(schema.file, schema.groups_line,
                       "groups = [\"{}\"]: every row is a group of its own, and a group of one row tells "
                       "nothing; name columns that rows have in common",
                       fmt::join(schema.groups, "\", \""));
}

/// What a column is an axis of: "load", forces and torques alike, or the unit of a sensor's channels. Empty:
/// of nothing. What one throttle, current or pressure does beside another is no crosstalk.
std::string axis_kind(const TableColumn& column) {
  const std::string_view quantity = unit_from_name(column.unit).quantity;
  if (quantity == "force" || quantity == "torque") return "load";
  const bool channel = quantity == "voltage" || quantity == "voltage ratio" || column.unit == "counts";
  return channel && column.meaning.empty() ? std::string(quantity) : "";
}

/// Columns of the same kind as the baseline's, for crosstalk.
void set_other_axes(const TableSchema& schema, const std::string& baseline, Observations& result) {
  // A load that is the baseline need not be a covariate: the others' unit says what it is.
  std::string kind = "load";
  for (const TableColumn& column : schema.covariates)
    if (column.column == baseline) kind = axis_kind(column);
  for (const TableColumn& column : schema.covariates)
    if (!kind.empty() && column.column != baseline && column.column != result.response &&
        axis_kind(column) == kind)
      result.other_axes.push_back(column.name());
}

/// Whether each group that the fit can see lies within one block.
void set_groups_within_blocks(Observations& result) {
  std::map<int, std::set<int>> blocks_of_group;
  for (std::size_t r = 0; r < result.group.size(); ++r)
    if (result.held_out.empty() || !result.held_out[r])
      blocks_of_group[result.group[r]].insert(result.block[r]);
  result.groups_within_blocks = result.groups() > 1 && !result.blocks_are_rows &&
                                std::all_of(blocks_of_group.begin(), blocks_of_group.end(),
                                            [](const auto& g) { return g.second.size() == 1; });
}

/// What the baseline is over is a condition as well: a curve over it shows where a line or a power law is
/// wrong. Returns its name there.
std::string keep_as_covariate(const TableSource& source, const std::string& column, Observations& result) {
  for (const TableColumn& each : source.table.schema.covariates)
    if (each.column == column) return each.name();
  Covariate covariate{column, MatrixXd(source.count(), 1)};
  for (Index r = 0; r < source.count(); ++r) covariate.value(r, 0) = source.cell(r, column);
  if (result.find(column) == nullptr) result.covariates.push_back(std::move(covariate));
  return column;
}

/// A table's rows have an order where a condition says so. Where groups share its numbers, the row before is
/// that of the own group: which other was loaded before it is not known.
void set_previous(Observations& result) {
  const Covariate* order = result.find("run_order");
  if (order == nullptr || result.not_usable.contains("run_order")) return;
  std::map<double, std::set<int>> groups;  // of each number
  for (std::size_t row = 0; row < result.previous.size(); ++row)
    groups[order->value(static_cast<Index>(row), 0)].insert(result.group[row]);
  const bool shared = std::ranges::any_of(groups, [](const auto& of) { return of.second.size() > 1; });
  std::map<std::pair<int, int>, int> last;  // of each block, and of each group where these share numbers
  for (std::size_t row = 0; row < result.previous.size(); ++row) {
    const std::pair own{result.blocks_are_rows ? 0 : result.block[row], shared ? result.group[row] : 0};
    if (const auto before = last.find(own); before != last.end()) result.previous[row] = before->second;
    last[own] = static_cast<int>(row);
  }
}

/// What a quantity is called here need not be the header's name for it.
void require_column(const TableSource& source, const std::string& baseline, const std::string& column) {
  const TableSchema& schema = source.table.schema;
  const auto means_it = [&](const TableColumn& described) { return described.meaning == column; };
  const auto covariate = std::ranges::find_if(schema.covariates, means_it);
  const std::string header = column == "speed_rpm" && schema.speed_column ? *schema.speed_column
                             : covariate != schema.covariates.end()       ? covariate->column
                                                                          : "";
  if (!column.empty() && !source.table.sheet.find(column) && !header.empty())
    throw InputError(
        fmt::format("--baseline {}: COLUMN is the header's name, which is {}", baseline, header));
  source.table.sheet.require(column);
}

/// constant, linear:COLUMN or power:COLUMN, the slope each group's own.
void set_baseline(const TableSource& source, const ObservationChoice& choice, Observations& result) {
  result.baseline = choice.baseline.empty() ? kConstantBaseline : choice.baseline;
  if (result.baseline == kConstantBaseline) return;
  const auto colon = result.baseline.find(':');
  const std::string kind = result.baseline.substr(0, colon);
  if ((kind != "linear" && kind != "power") || colon == std::string::npos)
    throw InputError(
        fmt::format("--baseline {}: a table has constant, linear:COLUMN and power:COLUMN", choice.baseline));
  const std::string column = result.baseline.substr(colon + 1);
  require_column(source, choice.baseline, column);
  if (kind == "linear" && result.multiplicative) {  // a straight line is no power law: additive
    result.multiplicative = false;
    result.y = result.value = (result.value.array() * result.sign.replicate(1, result.value.cols()).array());
    result.sign.resize(0);
    result.known.setOnes();
  }
  if (kind == "power" && !result.multiplicative) {
    const Index not_above_0 = (result.value.array() <= 0).count();
    throw InputError::in(source.row(*row_of_other_sign(source, result)).place,
                         "--baseline {}: the response must have one sign, and {} of {} rows have not that of "
                         "the others: leave them out, or take linear:COLUMN",
                         choice.baseline, std::min(not_above_0, result.rows() - not_above_0), result.rows());
  }
  result.slopes.resize(source.count(), 1);
  for (Index r = 0; r < source.count(); ++r) {
    const double x = source.cell(r, column);
    if (std::isnan(x) || (kind == "power" && x <= 0))
      throw InputError::in(source.row(r).place, "--baseline {}: column {} is {}", result.baseline, column,
                           std::isnan(x) ? "empty" : "not above 0");
    result.slopes(r, 0) = kind == "power" ? std::log(x) : x;
  }
  result.baseline_over = keep_as_covariate(source, column, result);
  if (column == result.response)
    throw InputError(fmt::format("--baseline {}: this is the response itself", result.baseline));
  const std::string_view over = unit_from_name(described(source.table.schema, column).unit).quantity;
  const bool of_load = over == "force" || over == "torque" || over == "pressure";
  result.line_of_cell = kind == "linear" && (of_load || (!result.of_air && !result.of_no_cell));
  if (kind == "linear") set_other_axes(source.table.schema, column, result);
}

}  // namespace

TableParts check_table(const ObservationTable& table) {
  Observations result;
  const TableSource source = used_rows(table, {}, result);
  set_belonging(source, result);
  set_hold_out(source, result);
  return {result.groups(), result.blocks()};
}

Observations observe_table(const ObservationTable& table, const ObservationChoice& choice) {
  Observations result;
  result.campaign = table.schema.name;
  TableSource source = used_rows(table, choice, result);
  sort_by_order(source, result);
  set_belonging(source, result);
  check_groups(table.schema, result);
  set_response(source, choice, result);
  if (!(result.value.maxCoeff() > result.value.minCoeff()))
    throw InputError(fmt::format("the response {} is the same in every row: there is nothing to explain",
                                 result.response));
  result.slopes.resize(source.count(), 0);
  const bool either_sign = result.value.minCoeff() < 0 && result.value.maxCoeff() > 0;
  set_scale(source, scatters_alike(table.schema, choice, either_sign), result);
  add_covariates(source, result);
  set_previous(result);
  set_baseline(source, choice, result);
  set_hold_out(source, result);
  set_groups_within_blocks(result);
  result.duration_s = VectorXd::Zero(source.count());
  result.newtons_per_volt = VectorXd::Ones(1);
  result.rig.rotors = 1;
  result.from_table = true;
  if (const Covariate* diameter = result.find(kDiameter))
    result.rig.propeller_radius_m = diameter->value.col(0).mean() / 2;
  if (const Covariate* speed = result.find("speed_rpm"))
    result.rig.nominal_speed_rpm = speed->value.col(0).mean();
  return result;
}

}  // namespace tunnelrig
