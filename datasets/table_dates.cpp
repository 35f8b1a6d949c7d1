#include "datasets/table_dates.h"

#include "datasets/campaign.h"
#include "datasets/error.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

double seconds_of(const Sheet& sheet, std::size_t row, const std::string& column) {
  const std::string text = sheet.text(row, column);
  if (const auto time = parse_utc(text)) return *time;
  if (const auto midnight = parse_utc(text + "T00:00")) return *midnight;
  throw InputError(fmt::format("{}: '{}' is no date; dates are written 2026-03-02 or 2026-03-02T08:00:00Z",
                               sheet.where(row, column), text));
}

}  // namespace

Sheet with_days_for_dates(Sheet sheet, const TableSchema& schema) {
  constexpr double kDay_s = 24 * 3600;
  for (const TableColumn& column : schema.covariates) {
    if (column.unit != kDateUnit) continue;
    const std::size_t place = sheet.require(column.column);
    std::vector<std::pair<std::size_t, double>> times;
    for (std::size_t row = 0; row < sheet.rows.size(); ++row)
      if (!sheet.text(row, column.column).empty())
        times.emplace_back(row, seconds_of(sheet, row, column.column));
    if (times.empty()) continue;
    const double first = std::ranges::min(times, {}, &std::pair<std::size_t, double>::second).second;
    for (const auto& [row, time_s] : times)
      sheet.rows[row].cells[place] = fmt::format("{:.10g}", (time_s - first) / kDay_s);
  }
  return sheet;
}

}  // namespace tunnelrig
