#include "datasets/observations.h"

#include <algorithm>
#include <array>

#define TOML_EXCEPTIONS 1
#include "datasets/error.h"

#include <toml++/toml.h>

namespace tunnelrig {
namespace {

/// What a column can mean to the suite, and the quantity that its unit must then be of.
struct Meaning {
  std::string_view name, quantity;
};
constexpr std::array<Meaning, 16> kMeanings = {{{"thrust_N", "force"},
                                                {"c_t", "number"},
                                                {"c_t_helicopter", "number"},
                                                {"c_t_propeller", "number"},
                                                {"speed_rpm", "speed"},
                                                {"air_temperature_C", "temperature"},
                                                {"air_pressure_Pa", "pressure"},
                                                {"relative_humidity", "number"},
                                                {"supply_voltage_V", "voltage"},
                                                {"tunnel_airspeed_m_s", "velocity"},
                                                {"cell_temperature_C", "temperature"},
                                                {"time_since_motor_start_s", "time"},
                                                {"propeller_diameter_m", "length"},
                                                {"ground_distance_R", "number"},
                                                {"ceiling_distance_R", "number"},
                                                {"wall_distance_R", "number"}}};

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

  bool flag(std::string_view key) const { return table_[key].value<bool>().value_or(false); }

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

  static int line(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

 private:
  static void check_meaning(const std::string& meaning, const Unit& unit) {
    if (meaning.empty()) return;
    std::vector<std::string_view> names;
    for (const Meaning& known : kMeanings) {
      if (known.name == meaning) {
        if (known.quantity == unit.quantity) return;
        throw InputError(fmt::format("{} is a {}, and '{}' is a unit of {}", meaning, known.quantity,
                                     unit.name, unit.quantity));
      }
      names.push_back(known.name);
    }
    throw InputError(fmt::format("'{}' is no known meaning; known are {}", meaning, fmt::join(names, " ")));
  }

  const toml::table& table_;
  std::string name_;
  const std::string& file_;
};

void check_blocks(const TableSchema& schema, const std::string& file) {
  const std::string& blocks = schema.blocks;
  if (!blocks.starts_with("bins(")) return;
  const auto comma = blocks.rfind(',');
  const auto count =
      comma == std::string::npos || !blocks.ends_with(')')
          ? std::nullopt
          : parse_number(std::string_view(blocks).substr(comma + 1, blocks.size() - comma - 2));
  if (!count || *count < 2 || *count > 10000) {
    throw InputError::in(
        file, "blocks = \"{}\"; write \"bins(COLUMN, N)\" with N from 2 to 10000, a column, or \"rows\"",
        blocks);
  }
}

void read_speed(const toml::table& document, const std::string& file, TableSchema& schema) {
  const toml::table* table = document["speed"].as_table();
  if (table == nullptr) return;
  const Reader reader(*table, "speed.", file);
  TableColumn column = reader.column();
  column.meaning = "speed_rpm";
  const Unit& unit = unit_from_name(column.unit);
  if (unit.quantity != "speed") {
    throw InputError::at(file, Reader::line(*table), "speed.unit is '{}', a unit of {}", column.unit,
                         unit.quantity);
  }
  schema.speed_column = column.column;
  schema.covariates.push_back(column);
  const auto poles = reader.number("pole_count", 2, 200);
  if (reader.flag("electrical") && !poles) {
    throw InputError::at(file, Reader::line(*table),
                         "speed.pole_count is required where the speed is electrical");
  }
  if (poles) schema.speed_factor = 2 / *poles;
}

void read_propeller(const toml::table& document, const std::string& file, TableSchema& schema) {
  const toml::table* table = document["propeller"].as_table();
  if (table == nullptr) return;
  const Reader reader(*table, "propeller.", file);
  schema.diameter_m = reader.number("diameter_m", 0.01, 10);
  schema.diameter_column = reader.string("diameter_column");
  if (!schema.diameter_column) return;
  const std::string name = reader.required_string("diameter_unit");
  const Unit& unit = unit_from_name(name);
  if (unit.quantity != "length") {
    throw InputError::at(file, Reader::line(*table), "propeller.diameter_unit is '{}', a unit of {}", name,
                         unit.quantity);
  }
  schema.diameter_unit_m = unit.factor;
}

void read_covariates(const toml::table& document, const std::string& file, TableSchema& schema) {
  const toml::array* list = document["covariates"].as_array();
  if (list == nullptr) return;
  for (const toml::node& node : *list) {
    const toml::table* table = node.as_table();
    if (table == nullptr)
      throw InputError::at(file, Reader::line(node), "covariates: write [[covariates]] tables");
    schema.covariates.push_back(Reader(*table, "covariates.", file).column());
  }
}

/// Converts one cell; the column exists.
std::optional<double> converted(const Sheet& sheet, std::size_t row, const TableColumn& column) {
  const auto value = sheet.number(row, column.column);
  if (!value) return {};
  const double si = unit_from_name(column.unit).convert(*value);
  if (unit_from_name(column.unit).quantity == "temperature" && si < -273.15) {
    throw InputError(fmt::format("{}: {:g} {} is below absolute zero", sheet.where(row, column.column),
                                 *value, column.unit));
  }
  const bool air = column.meaning == "air_temperature_C", cell = column.meaning == "cell_temperature_C";
  if ((air || cell) && (si < -80 || si > (air ? 80 : 200))) {
    throw InputError(
        fmt::format("{}: {:g} {} is no temperature of {}; degrees Celsius, kelvin or Fahrenheit?",
                    sheet.where(row, column.column), *value, column.unit, air ? "air" : "a cell"));
  }
  return si;
}

Observation read_row(const Sheet& sheet, std::size_t row, const TableSchema& schema) {
  Observation observation{.line = sheet.rows[row].line,
                          .group = {},
                          .air_temperature_C = schema.air_temperature_C,
                          .air_pressure_Pa = schema.air_pressure_Pa};
  const auto response = converted(sheet, row, schema.response);
  if (!response)
    throw InputError(
        fmt::format("{}: the response must not be empty", sheet.where(row, schema.response.column)));
  observation.response = *response;
  for (const std::string& column : schema.groups) {
    observation.group += (observation.group.empty() ? "" : " / ") + sheet.text(row, column);
  }
  observation.diameter_m = schema.diameter_m;
  if (schema.diameter_column) {
    observation.diameter_m = sheet.require_number(row, *schema.diameter_column) * schema.diameter_unit_m;
  }
  for (const TableColumn& column : schema.covariates) {
    const auto value = converted(sheet, row, column);
    if (!value) continue;
    if (column.column == schema.speed_column) observation.speed_rpm = *value * schema.speed_factor;
    if (column.meaning == "air_temperature_C") observation.air_temperature_C = *value;
    if (column.meaning == "air_pressure_Pa") observation.air_pressure_Pa = *value;
  }
  return observation;
}

}  // namespace

TableSchema parse_table_schema(const std::string& text, const std::string& file) {
  toml::table document;
  try {
    document = toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError::at(file, static_cast<int>(error.source().begin.line), "{}", error.description());
  }
  const Reader top(document, "", file);
  if (top.string("format") != std::string(kTableFormat)) {
    throw InputError::at(file, 1, "the key format = \"{}\" is required", kTableFormat);
  }
  TableSchema schema;
  schema.toml = text;
  schema.name = top.string("name").value_or("");
  const toml::table* response = document["response"].as_table();
  if (response == nullptr) throw InputError::at(file, 1, "the table [response] is required");
  schema.response = Reader(*response, "response.", file).column();
  if (const toml::array* groups = document["groups"].as_array()) {
    for (const toml::node& node : *groups) {
      const auto column = node.value<std::string>();
      if (!column) throw InputError::at(file, Reader::line(node), "groups must be a list of column names");
      schema.groups.push_back(*column);
    }
  } else if (const auto group = top.string("groups")) {
    schema.groups.push_back(*group);
  }
  schema.blocks = top.string("blocks").value_or("rows");
  check_blocks(schema, file);
  schema.hold_out = top.string("hold_out").value_or("");
  read_covariates(document, file, schema);
  read_speed(document, file, schema);
  read_propeller(document, file, schema);
  if (const toml::table* air = document["air"].as_table()) {
    const Reader reader(*air, "air.", file);
    schema.air_temperature_C = reader.number("temperature_C", -80, 80).value_or(schema.air_temperature_C);
    schema.air_pressure_Pa = reader.number("pressure_Pa", 30000, 120000).value_or(schema.air_pressure_Pa);
  }
  return schema;
}

ObservationTable read_observations(const Sheet& sheet, const TableSchema& schema) {
  sheet.require(schema.response.column);
  for (const std::string& column : schema.groups) sheet.require(column);
  for (const TableColumn& column : schema.covariates) sheet.require(column.column);
  if (schema.diameter_column) sheet.require(*schema.diameter_column);
  if (schema.blocks.starts_with("bins(")) {
    const auto comma = schema.blocks.rfind(',');
    sheet.require(schema.blocks.substr(5, comma - 5));
  } else if (schema.blocks != "rows") {
    sheet.require(schema.blocks);
  }
  if (sheet.rows.empty()) throw InputError::in(sheet.file, "holds no row of observations");
  ObservationTable table{.schema = schema, .sheet = sheet, .rows = {}};
  for (std::size_t row = 0; row < sheet.rows.size(); ++row)
    table.rows.push_back(read_row(sheet, row, schema));
  return table;
}

ObservationTable observations_of(const CampaignFile& file) {
  const auto toml = file.text("table.toml");
  auto sheet = file.sheet("observations");
  if (!toml || !sheet) throw InputError::in(file.path().string(), "holds no table of observations");
  if (const auto source = file.text("table.source")) sheet->file = *source;
  return read_observations(*sheet, parse_table_schema(*toml, "table.toml"));
}

std::size_t store_table(const Sheet& sheet, const TableSchema& schema, const std::filesystem::path& file,
                        bool replace) {
  const ObservationTable table = read_observations(sheet, schema);
  StagedCampaign staged(file, replace);
  staged.file().set_text("table.toml", schema.toml);
  staged.file().set_text("table.source", std::filesystem::path(sheet.file).filename().string());
  staged.file().set_sheet("observations", sheet);
  staged.publish();
  return table.rows.size();
}

std::size_t import_table(const std::filesystem::path& csv, const std::filesystem::path& schema,
                         const std::filesystem::path& file, bool replace) {
  const TableSchema parsed = parse_table_schema(read_text(schema), schema.string());
  return store_table(read_csv(csv), parsed, file, replace);
}

}  // namespace tunnelrig
