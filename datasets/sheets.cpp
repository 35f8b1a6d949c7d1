// The sheets of a campaign file: what arrived as CSV, a row a JSON array of its cells' texts.
#include "datasets/campaign_file.h"
#include "datasets/error.h"
#include "datasets/sqlite.h"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Texts = std::vector<std::string>;

Texts texts_of(const std::string& json) { return nlohmann::json::parse(json).get<Texts>(); }
std::string json_of(const Texts& texts) { return nlohmann::json(texts).dump(); }

std::optional<Texts> columns_of(const Database& database, std::string_view sheet) {
  Statement select(database, "SELECT columns FROM sheets WHERE sheet = ?");
  select.bind(sheet);
  if (!select.step()) return {};
  return texts_of(select.text(0));
}

void set_columns(Database& database, std::string_view sheet, const Texts& columns) {
  Statement(database,
            "INSERT INTO sheets (sheet, columns) VALUES (?1, ?2) "
            "ON CONFLICT (sheet) DO UPDATE SET columns = ?2")
      .bind(sheet)
      .bind(json_of(columns))
      .run();
}

/// A row of a sheet, found by one of its cells.
struct FoundRow {
  Texts columns, cells;
  std::int64_t row = 0;
};

FoundRow find_row(const Database& database, std::string_view sheet, std::string_view key,
                  std::string_view value) {
  FoundRow found;
  found.columns = columns_of(database, sheet).value_or(Texts());
  const auto at = std::find(found.columns.begin(), found.columns.end(), key);
  if (at != found.columns.end()) {
    Statement select(database,
                     "SELECT row, cells FROM sheet_rows WHERE sheet = ? AND json_extract(cells, ?) = ?");
    select.bind(sheet).bind(fmt::format("$[{}]", at - found.columns.begin())).bind(value);
    if (select.step()) {
      found.row = select.integer(0);
      found.cells = texts_of(select.text(1));
      found.cells.resize(found.columns.size());
      return found;
    }
  }
  throw InputError(fmt::format("there is no {} {}", key, value));
}

}  // namespace

std::optional<Sheet> CampaignFile::sheet(std::string_view name) const {
  auto columns = columns_of(*database_, name);
  if (!columns) return {};
  Sheet sheet{.file = fmt::format("{}.csv", name), .columns = *std::move(columns), .rows = {}};
  Statement rows(*database_, "SELECT cells FROM sheet_rows WHERE sheet = ? ORDER BY row");
  rows.bind(name);
  while (rows.step()) {
    Texts cells = texts_of(rows.text(0));
    cells.resize(sheet.columns.size());  // rows written before a column was added are shorter
    sheet.rows.push_back({std::move(cells), static_cast<int>(sheet.rows.size()) + 2});
  }
  return sheet;
}

void CampaignFile::set_sheet(std::string_view name, const Sheet& sheet) {
  Statement(*database_, "DELETE FROM sheets WHERE sheet = ?").bind(name).run();
  set_columns(*database_, name, sheet.columns);
  Statement insert(*database_, "INSERT INTO sheet_rows (sheet, row, cells) VALUES (?, ?, ?)");
  for (std::size_t row = 0; row < sheet.rows.size(); ++row)
    insert.bind(name).bind(static_cast<std::int64_t>(row)).bind(json_of(sheet.rows[row].cells)).run();
}

void CampaignFile::append_row(std::string_view name,
                              const std::vector<std::pair<std::string, std::string>>& cells) {
  const auto columns = columns_of(*database_, name);
  Sheet row{.file = "", .columns = columns.value_or(Texts()), .rows = {{}}};
  row.rows[0].cells.resize(row.columns.size());
  for (const auto& [column, text] : cells) {
    const std::size_t index = row.ensure(column);
    row.rows[0].cells[index] = text;
  }
  if (row.columns != columns) set_columns(*database_, name, row.columns);
  Statement(*database_,
            "INSERT INTO sheet_rows (sheet, row, cells) "
            "SELECT ?1, coalesce(max(row), -1) + 1, ?2 FROM sheet_rows WHERE sheet = ?1")
      .bind(name)
      .bind(json_of(row.rows[0].cells))
      .run();
}

std::string CampaignFile::cell(std::string_view name, std::string_view key, std::string_view value,
                               std::string_view column) const {
  const FoundRow found = find_row(*database_, name, key, value);
  const auto at = std::find(found.columns.begin(), found.columns.end(), column);
  return at == found.columns.end() ? "" : found.cells[static_cast<std::size_t>(at - found.columns.begin())];
}

void CampaignFile::set_cell(std::string_view name, std::string_view key, std::string_view value,
                            std::string_view column, std::string_view text) {
  FoundRow found = find_row(*database_, name, key, value);
  auto at = std::find(found.columns.begin(), found.columns.end(), column);
  if (at == found.columns.end()) {
    if (text.empty()) return;
    at = found.columns.insert(found.columns.end(), std::string(column));
    found.cells.emplace_back();
    set_columns(*database_, name, found.columns);
  }
  found.cells[static_cast<std::size_t>(at - found.columns.begin())] = text;
  Statement(*database_, "UPDATE sheet_rows SET cells = ? WHERE sheet = ? AND row = ?")
      .bind(json_of(found.cells))
      .bind(name)
      .bind(found.row)
      .run();
}

}  // namespace tunnelrig
