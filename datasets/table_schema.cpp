#include "datasets/error.h"
#include "datasets/meanings.h"
#include "datasets/observations.h"
#include "datasets/toml_keys.h"

#include <algorithm>
#include <cmath>

#include <toml++/toml.h>

namespace tunnelrig {
namespace {

/// Reads keys of a TOML table, with file and line in every message.
class Reader {
 public:
  Reader(const toml::table& table, std::string name, const std::string& file)
      : table_(table), name_(std::move(name)), file_(file) {}

  std::optional<std::string> string(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    if (auto value = node->value<std::string>()) return value;
    throw InputError::at(file_, line(*node), "{}{} must be text in quotes", name_, key);
  }

  std::string required_string(std::string_view key) const {
    if (const auto value = string(key)) return *value;
    throw InputError::at(file_, line(table_), "{}{} is required", name_, key);
  }

  std::optional<double> number(std::string_view key, double lowest, double highest) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    const auto value = node->value<double>();
    if (value && *value >= lowest && *value <= highest) return value;
    throw InputError::at(file_, line(*node), "{}{} must be a number from {:g} to {:g}", name_, key, lowest,
                         highest);
  }

  bool flag(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return false;
    if (const auto value = node->value<bool>()) return *value;
    throw InputError::at(file_, line(*node), "{}{} must be true or false", name_, key);
  }

  /// The table of that name, or nothing; a value where a table belongs would be lost.
  const toml::table* table(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr || node->is_table()) return table_[key].as_table();
    throw InputError::at(file_, line(*node), "{} must be a table: write [{}]", key, key);
  }

  TableColumn column() const {
    TableColumn column{required_string("column"), string("unit").value_or("1"),
                       string("meaning").value_or("")};
    try {
      const Unit& unit = unit_from_name(column.unit);
      check_meaning(column.meaning, unit);
    } catch (const InputError& error) {
      throw InputError::at(file_, line(table_), "{}: {}", column.column, error.what());
    }
    return column;
  }

  const Unit& unit(std::string_view key) const {
    const std::string name = required_string(key);
    try {
      return unit_from_name(name);
    } catch (const InputError& error) {
      throw InputError::at(file_, line_of(key), "{}{}: {}", name_, key, error.what());
    }
  }

  void only(std::initializer_list<std::string_view> keys) const {
    require_known_keys(table_, name_.empty() ? "the file" : name_.substr(0, name_.size() - 1), file_, keys);
  }

  /// Of a key, or of the table where the key is not there.
  int line_of(std::string_view key) const {
    const toml::node* node = table_.get(key);
    return line(node == nullptr ? table_ : *node);
  }

  static int line(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

 private:
  const toml::table& table_;
  std::string name_;
  const std::string& file_;
};

std::string_view without_blanks(std::string_view text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// A column, "rows", or "bins(COLUMN, N)".
void read_blocks(const Reader& top, TableSchema& schema) {
  schema.blocks = top.string("blocks").value_or("rows");
  schema.blocks_line = top.line_of("blocks");
  if (!schema.blocks.starts_with("bins(")) return;
  const std::string_view text = schema.blocks;
  const auto comma = text.rfind(',');
  std::optional<double> count;
  if (comma != std::string_view::npos && text.ends_with(')'))
    count = parse_number(text.substr(comma + 1, text.size() - comma - 2));
  if (!count || *count < 2 || *count > 10000 || *count != std::floor(*count)) {
    throw InputError::at(
        schema.file, schema.blocks_line,
        "blocks = \"{}\"; write \"bins(COLUMN, N)\" with a whole N from 2 to 10000, a column, or \"rows\"",
        text);
  }
  schema.bins = {std::string(without_blanks(text.substr(5, comma - 5))), static_cast<int>(*count)};
}

void read_groups(const toml::table& document, const Reader& top, TableSchema& schema) {
  schema.groups_line = top.line_of("groups");
  const toml::array* groups = document["groups"].as_array();
  if (groups == nullptr) {
    if (const auto group = top.string("groups")) schema.groups.push_back(*group);
    return;
  }
  for (const toml::node& node : *groups) {
    const auto column = node.value<std::string>();
    if (!column)
      throw InputError::at(schema.file, Reader::line(node), "groups must be a list of column names");
    schema.groups.push_back(*column);
  }
}

void add_covariate(const TableColumn& column, int line, TableSchema& schema) {
  for (const TableColumn& other : schema.covariates)
    if (!column.meaning.empty() && other.meaning == column.meaning)
      throw InputError::at(schema.file, line, "{}: {} is {} already; one column can be it", column.column,
                           other.column, column.meaning);
  schema.covariates.push_back(column);
}

void read_speed(const Reader& top, TableSchema& schema) {
  const std::string& file = schema.file;
  const toml::table* table = top.table("speed");
  if (table == nullptr) return;
  const Reader reader(*table, "speed.", file);
  reader.only({"column", "unit", "electrical", "pole_count"});
  TableColumn column = reader.column();
  column.meaning = "speed_rpm";
  const Unit& unit = unit_from_name(column.unit);
  if (unit.quantity != "speed") {
    throw InputError::at(file, Reader::line(*table), "speed.unit is '{}', a unit of {}", column.unit,
                         unit.quantity);
  }
  schema.speed_column = column.column;
  add_covariate(column, Reader::line(*table), schema);
  const auto poles = reader.number("pole_count", 2, 200);
  const bool electrical = reader.flag("electrical");
  if (electrical && !poles) {
    throw InputError::at(file, Reader::line(*table),
                         "speed.pole_count is required where the speed is electrical");
  }
  if (poles && !electrical) {
    // Either the speeds are electrical or the key is idle: which, only who wrote the schema knows.
    throw InputError::at(file, reader.line_of("pole_count"),
                         "speed.pole_count is of electrical speeds: write electrical = true beside it, or "
                         "leave it out where the speed is the shaft's");
  }
  if (poles && std::fmod(*poles, 2) != 0)
    throw InputError::at(file, Reader::line(*table),
                         "speed.pole_count is {:g}: poles come in pairs, so it is an even number", *poles);
  if (poles) schema.speed_factor = 2 / *poles;
}

void read_propeller(const Reader& top, TableSchema& schema) {
  const std::string& file = schema.file;
  const toml::table* table = top.table("propeller");
  if (table == nullptr) return;
  const Reader reader(*table, "propeller.", file);
  reader.only({"diameter_m", "diameter_column", "diameter_unit"});
  schema.diameter_m = reader.number("diameter_m", 0.01, 10);
  schema.diameter_column = reader.string("diameter_column");
  if (!schema.diameter_column) return;
  if (schema.diameter_m)
    throw InputError::at(file, Reader::line(*table),
                         "propeller.diameter_m and propeller.diameter_column: write one of them");
  const Unit& unit = reader.unit("diameter_unit");
  if (unit.quantity != "length") {
    throw InputError::at(file, Reader::line(*table), "propeller.diameter_unit is '{}', a unit of {}",
                         unit.name, unit.quantity);
  }
  schema.diameter_unit_m = unit.factor;
}

void read_covariates(const toml::table& document, TableSchema& schema) {
  const toml::node* node = document.get("covariates");
  if (node == nullptr) return;
  const toml::array* list = node->as_array();
  if (list == nullptr)
    throw InputError::at(schema.file, Reader::line(*node), "covariates: write [[covariates]] for each");
  for (const toml::node& one : *list) {
    const toml::table* table = one.as_table();
    if (table == nullptr)
      throw InputError::at(schema.file, Reader::line(one), "covariates: write [[covariates]] for each");
    const Reader reader(*table, "covariates.", schema.file);
    reader.only({"column", "unit", "meaning"});
    add_covariate(reader.column(), Reader::line(*table), schema);
  }
}

void read_air(const Reader& top, TableSchema& schema) {
  const toml::table* air = top.table("air");
  if (air == nullptr) return;
  const Reader reader(*air, "air.", schema.file);
  reader.only({"temperature_C", "pressure_Pa"});
  schema.air_temperature_C = reader.number("temperature_C", -80, 80).value_or(schema.air_temperature_C);
  schema.air_pressure_Pa = reader.number("pressure_Pa", 20000, 120000).value_or(schema.air_pressure_Pa);
}

}  // namespace

TableSchema parse_table_schema(const std::string& text, const std::string& file) {
  toml::table document;
  try {
    document = toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError::at(file, static_cast<int>(error.source().begin.line), "{}", error.description());
  }
  TableSchema schema;
  schema.toml = text;
  schema.file = file;
  const Reader top(document, "", schema.file);
  if (top.string("format") != std::string(kTableFormat)) {
    throw InputError::at(file, 1, "the key format = \"{}\" is required", kTableFormat);
  }
  top.only({"format", "name", "groups", "blocks", "hold_out", "response", "speed", "propeller", "air",
            "covariates"});
  schema.name = top.string("name").value_or("");
  const toml::table* response = top.table("response");
  if (response == nullptr) throw InputError::at(file, 1, "the table [response] is required");
  const Reader of_response(*response, "response.", schema.file);
  of_response.only({"column", "unit", "meaning", "scatter"});
  schema.response = of_response.column();
  if (schema.response.unit == kTextUnit || schema.response.unit == kDateUnit)
    throw InputError::at(file, of_response.line_of("unit"), "response.unit is \"{}\"; a response is a number",
                         schema.response.unit);
  schema.scatter = of_response.string("scatter").value_or("");
  if (!schema.scatter.empty() && schema.scatter != "relative" && schema.scatter != "absolute")
    throw InputError::at(file, of_response.line_of("scatter"),
                         "scatter = \"{}\"; write \"relative\" (it grows with the response) or \"absolute\"",
                         schema.scatter);
  read_groups(document, top, schema);
  read_blocks(top, schema);
  schema.hold_out = top.string("hold_out").value_or("");
  schema.hold_out_line = top.line_of("hold_out");
  read_covariates(document, schema);
  read_speed(top, schema);
  read_propeller(top, schema);
  read_air(top, schema);
  return schema;
}

}  // namespace tunnelrig
