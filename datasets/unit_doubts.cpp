#include "datasets/unit_doubts.h"

#include "datasets/another_unit.h"
#include "datasets/first_few.h"
#include "datasets/unit_list.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig {
namespace {

/// A number without unit may be anything. Times are set by who plans a session, and a minute and an hour are
/// a factor of 60 apart as a second and a minute are.
bool says_a_unit(const Unit& unit) {
  return unit.quantity != "text" && unit.quantity != "time" &&
         !(unit.quantity == "number" && unit.factor == 1);
}

const Unit* unit_of_name(std::string_view column) {
  const std::string_view unit = unit_in_ending(column);
  return unit.empty() ? nullptr : &unit_from_name(unit);
}

std::string rounded(double value) {
  return std::abs(value) < 1000 ? fmt::format("{:.3g}", value) : fmt::format("{:.0f}", value);
}

std::string in_words(const Extent& extent, std::string (*one)(double)) {
  const std::string lowest = one(extent.lowest), highest = one(extent.highest);
  return lowest == highest ? lowest : fmt::format("{} to {}", lowest, highest);
}

/// Doubts of one sheet; columns that are doubted alike are one sentence.
class Collector {
 public:
  explicit Collector(const Sheet& sheet) : sheet_(sheet) {}

  /// `part`: what a part is called, "session".
  void add(std::string_view part, const std::string& column, AnotherUnit found) {
    columns_.insert(column);
    if (!said_.empty() && said_.back().found.parts == found.parts && said_.back().found.unit == found.unit)
      said_.back().more.push_back(column);
    else
      said_.push_back({std::string(part), column, std::move(found), {}});
  }

  UnitDoubts doubts() const {
    UnitDoubts doubts{.sentences = {}, .columns = columns_};
    for (const Said& said : said_) doubts.sentences.push_back(sentence(said));
    return doubts;
  }

 private:
  struct Said {
    std::string part, column;
    AnotherUnit found;
    std::vector<std::string> more;  // columns of which the same is true
  };

  std::string sentence(const Said& said) const {
    const auto as_written = [](double value) { return fmt::format("{:g}", value); };
    const AnotherUnit& found = said.found;
    const std::string first = sheet_.place(found.first_row), last = sheet_.place(found.last_row);
    return fmt::format(
        "{}, column {}: {} {} {} {}, all others {}; from {} these would be {}: another unit?{}",
        first == last ? first : fmt::format("{} to {}", first, last), said.column, said.part,
        first_few(found.parts, 3), found.parts.size() == 1 ? "has" : "have",
        in_words(found.written, as_written), in_words(found.others, as_written),
        found.unit == "1" ? "fractions" : found.unit, in_words(found.converted, rounded),
        said.more.empty() ? "" : fmt::format(" It is so in {} too", fmt::join(said.more, ", ")));
  }

  const Sheet& sheet_;
  std::vector<Said> said_;
  std::set<std::string> columns_;
};

/// What the values of a table are divided by.
struct Division {
  std::string name;
  std::vector<std::string> parts;  // of each row
  double least_factor = kLeastFactor;
};

std::vector<Division> divisions(const ObservationTable& table) {
  const TableSchema& schema = table.schema;
  const auto is_group = [&](const std::string& column) {
    return std::find(schema.groups.begin(), schema.groups.end(), column) != schema.groups.end();
  };
  std::vector<Division> divisions;
  if (schema.blocks != "rows" && !schema.bins && !is_group(schema.blocks)) {
    divisions.push_back({schema.blocks, {}});
    for (std::size_t row = 0; row < table.rows.size(); ++row)
      divisions.back().parts.push_back(table.sheet.text(row, schema.blocks));
  }
  if (!schema.groups.empty()) {
    divisions.push_back({"group", {}, kLeastFactorOfGroups});
    for (const Observation& row : table.rows) divisions.back().parts.push_back(row.group);
  }
  return divisions;
}

using ColumnUnit = std::pair<std::string, const Unit*>;

std::vector<ColumnUnit> columns_with_units(const TableSchema& schema) {
  std::vector<ColumnUnit> columns = {{schema.response.column, &unit_from_name(schema.response.unit)}};
  for (const TableColumn& covariate : schema.covariates)
    columns.emplace_back(covariate.column, &unit_from_name(covariate.unit));
  if (schema.diameter_column) {
    for (const Unit& unit : known_units())
      if (unit.quantity == "length" && unit.factor == schema.diameter_unit_m)
        columns.emplace_back(*schema.diameter_column, &unit);
  }
  std::erase_if(columns, [](const ColumnUnit& column) { return !says_a_unit(*column.second); });
  return columns;
}

}  // namespace

UnitDoubts unit_doubts(const Sheet& runs_sheet, const std::vector<Run>& runs) {
  Collector collector(runs_sheet);
  for (const std::string& column : runs_sheet.columns) {
    const Unit* unit = unit_of_name(column);
    if (unit == nullptr) continue;
    const bool of_rotors = unit->quantity == "force" || unit->quantity == "speed";
    std::vector<PartValue> values;
    for (const Run& run : runs) {
      const auto value = run.number(column);
      if (value && run.excluded.empty() && !(of_rotors && run.kind == RunKind::kTare))
        values.push_back({run.session, run.row, *value});
    }
    if (auto found = another_unit(values, *unit)) collector.add("session", column, *std::move(found));
  }
  return collector.doubts();
}

UnitDoubts unit_doubts(const ObservationTable& table) {
  Collector collector(table.sheet);
  const std::vector<Division> all = divisions(table);
  for (const auto& [column, unit] : columns_with_units(table.schema)) {
    for (const Division& division : all) {
      std::vector<PartValue> values;
      for (std::size_t row = 0; row < table.rows.size(); ++row)
        if (const auto value = table.sheet.number(row, column))
          values.push_back({division.parts[row], row, *value});
      auto found = another_unit(values, *unit, division.least_factor);
      if (!found) continue;
      collector.add(division.name, column, *std::move(found));
      break;  // blocks and groups may be the same rows
    }
  }
  return collector.doubts();
}

}  // namespace tunnelrig
