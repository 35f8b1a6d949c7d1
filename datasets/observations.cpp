#include "datasets/observations.h"

#include "datasets/error.h"
#include "datasets/meanings.h"
#include "datasets/table_dates.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

/// Of a column whose name says a unit that is not SI's; nullptr of others, and of units of another quantity.
const Unit* unit_in_name(const TableColumn& column) {
  const std::string& name = column.name();
  if (name != "hours_in_session" && name != "tilt_deg") return nullptr;
  const Unit& said = unit_from_name(name == "tilt_deg" ? "deg" : "h");
  return said.quantity == unit_from_name(column.unit).quantity ? &said : nullptr;
}

/// Converts one cell; the column exists.
std::optional<double> converted(const Sheet& sheet, std::size_t row, const TableColumn& column) {
  const auto value = sheet.number(row, column.column);
  if (!value) return {};
  const Unit& unit = unit_from_name(column.unit);
  const double si = column.converted(*value);
  if (const auto rule = impossible(si, unit, column.meaning))
    throw InputError(fmt::format("{}: {:g}{}{} is {}", sheet.where(row, column.column), *value,
                                 column.unit == "1" ? "" : " ", column.unit == "1" ? "" : column.unit,
                                 *rule));
  return si;
}

constexpr double kNotRead = std::numeric_limits<double>::quiet_NaN();

/// A column without any number is as good as none: all rows have what the schema says.
void assume_where_none_was_read(double Observation::*air, double assumed, std::vector<Observation>& rows) {
  if (std::ranges::all_of(rows, [&](const Observation& row) { return std::isnan(row.*air); }))
    for (Observation& row : rows) row.*air = assumed;
}

Observation read_row(const Sheet& sheet, std::size_t row, const TableSchema& schema) {
  Observation observation{.place = sheet.place(row),
                          .group = {},
                          .air_temperature_C = schema.air_temperature_C,
                          .air_pressure_Pa = schema.air_pressure_Pa};
  const auto response = converted(sheet, row, schema.response);
  if (!response)
    throw InputError(fmt::format("{}: the response must not be empty: take the row out if there is none",
                                 sheet.where(row, schema.response.column)));
  observation.response = *response;
  for (const std::string& column : schema.groups) {
    observation.group += (observation.group.empty() ? "" : " / ") + sheet.text(row, column);
  }
  observation.diameter_m = schema.diameter_m;
  if (schema.diameter_column) {
    const double diameter = sheet.require_number(row, *schema.diameter_column);
    if (!(diameter > 0))
      throw InputError(fmt::format("{}: {:g} is no diameter of a propeller; it is above 0",
                                   sheet.where(row, *schema.diameter_column), diameter));
    observation.diameter_m = diameter * schema.diameter_unit_m;
  }
  for (const TableColumn& column : schema.covariates) {
    if (column.unit == kTextUnit) continue;
    const auto value = converted(sheet, row, column);
    if (column.meaning == "air_temperature_C") observation.air_temperature_C = value.value_or(kNotRead);
    if (column.meaning == "air_pressure_Pa") observation.air_pressure_Pa = value.value_or(kNotRead);
    if (!value) continue;
    if (column.column == schema.speed_column) observation.speed_rpm = *value * schema.speed_factor;
  }
  return observation;
}

/// Lines of the CSV where they do not simply follow: blank ones, cells of several lines, stacked files. And
/// of stacked files, which rows are whose: [[name, how many], …].
void store_places(const Sheet& sheet, CampaignFile& file) {
  std::vector<int> lines;
  std::vector<std::pair<std::string, std::size_t>> files;
  bool follow = true;
  for (const Sheet::Row& row : sheet.rows) {
    lines.push_back(row.line);
    follow = follow && row.line == static_cast<int>(lines.size()) + 1;
    if (files.empty() || files.back().first != row.file) files.emplace_back(row.file, 0);
    ++files.back().second;
  }
  if (!follow) file.set_text("table.lines", nlohmann::json(lines).dump());
  if (files.size() > 1 || !files.front().first.empty())
    file.set_text("table.files", nlohmann::json(files).dump());
}

void restore_places(const CampaignFile& file, Sheet& sheet) {
  if (const auto text = file.text("table.lines")) {
    const auto lines = nlohmann::json::parse(*text).get<std::vector<int>>();
    for (std::size_t row = 0; row < std::min(lines.size(), sheet.rows.size()); ++row)
      sheet.rows[row].line = lines[row];
  }
  if (const auto text = file.text("table.files")) {
    std::size_t row = 0;
    for (const auto& [name, count] :
         nlohmann::json::parse(*text).get<std::vector<std::pair<std::string, std::size_t>>>())
      for (std::size_t i = 0; i < count && row < sheet.rows.size(); ++i) sheet.rows[row++].file = name;
  }
}

}  // namespace

std::string_view TableColumn::kept_unit() const {
  const Unit* said = unit_in_name(*this);
  return said == nullptr ? unit_after_conversion(unit) : said->name;
}

double TableColumn::converted(double value) const {
  const Unit* said = unit_in_name(*this);
  return unit_from_name(unit).convert(value) / (said == nullptr ? 1 : said->factor);
}

ObservationTable read_observations(const Sheet& sheet, const TableSchema& schema) {
  sheet.require(schema.response.column);
  for (const std::string& column : schema.groups) sheet.require(column);
  for (const TableColumn& column : schema.covariates) sheet.require(column.column);
  if (schema.diameter_column) sheet.require(*schema.diameter_column);
  if (schema.bins) {
    sheet.require(schema.bins->column);
  } else if (schema.blocks != "rows") {
    sheet.require(schema.blocks);
  }
  if (sheet.rows.empty()) throw InputError::in(sheet.file, "holds no row of observations");
  ObservationTable table{.schema = schema, .sheet = sheet, .rows = {}};
  for (std::size_t row = 0; row < sheet.rows.size(); ++row)
    table.rows.push_back(read_row(sheet, row, schema));
  assume_where_none_was_read(&Observation::air_temperature_C, schema.air_temperature_C, table.rows);
  assume_where_none_was_read(&Observation::air_pressure_Pa, schema.air_pressure_Pa, table.rows);
  return table;
}

ObservationTable observations_of(const CampaignFile& file) {
  const auto toml = file.text("table.toml");
  auto sheet = file.sheet("observations");
  if (!toml || !sheet) throw InputError::in(file.path().string(), "holds no table of observations");
  if (const auto source = file.text("table.source")) sheet->file = *source;
  restore_places(file, *sheet);
  return read_observations(*sheet,
                           parse_table_schema(*toml, file.text("table.schema").value_or("table.toml")));
}

void store_table(const ObservationTable& table, const std::filesystem::path& file, bool replace) {
  const auto name_of = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  StagedCampaign staged(file, replace);
  staged.file().set_text("table.toml", table.schema.toml);
  staged.file().set_text("table.schema", name_of(table.schema.file));
  staged.file().set_text("table.source", name_of(table.sheet.file));
  staged.file().set_sheet("observations", table.sheet);
  store_places(table.sheet, staged.file());
  staged.publish();
}

ObservationTable read_table(const std::filesystem::path& csv, const std::filesystem::path& schema) {
  const TableSchema parsed = parse_table_schema(read_text(schema), schema.string());
  return read_observations(with_days_for_dates(read_csv(csv), parsed), parsed);
}

}  // namespace tunnelrig
