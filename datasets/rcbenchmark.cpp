#include "datasets/rcbenchmark.h"

#include "datasets/error.h"
#include "datasets/lower_case.h"
#include "datasets/table_dates.h"

#include <algorithm>
#include <map>

namespace tunnelrig {
namespace {

constexpr std::string_view kMessage = "App message";  // in the program's own words, commas and all

/// In capitals as well: a sweep that is passed over would not be missed.
bool is_csv(const std::filesystem::path& path) { return lower_case(path.extension().string()) == ".csv"; }

std::vector<std::filesystem::path> sweep_files(const std::filesystem::path& source) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  if (!std::filesystem::is_directory(source, error)) return {source};
  for (const auto& entry : std::filesystem::directory_iterator(source)) {
    if (is_csv(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) throw InputError::in(source.string(), "holds no .csv file");
  return files;
}

/// The row of `sweeps` that speaks of `file`, or nothing.
std::optional<std::size_t> sweep_row(const Sheet& sweeps, const std::string& file) {
  for (std::size_t row = 0; row < sweeps.rows.size(); ++row) {
    if (sweeps.text(row, "file") == file) return row;
  }
  return {};
}

void append_sweep(Sheet& all, const Sheet& sweep, const Sheet& sweeps, const std::string& file) {
  const auto known = sweep_row(sweeps, file);
  if (const auto advice = separator_advice(sweep.columns); !advice.empty())
    throw InputError::at(sweep.file, 1, "its columns cannot be told apart{}", advice);
  if (!sweeps.columns.empty() && !known) throw InputError::in(sweeps.file, "has no row for {}", file);
  for (const Sheet::Row& row : sweep.rows) {
    all.rows.push_back({std::vector<std::string>(all.columns.size()), row.line, file});
    const auto put = [&all](const std::string& column, const std::string& text) {
      if (column.empty()) return;
      const std::size_t index = all.ensure(column);
      all.rows.back().cells[index] = text;
    };
    put("file", file);
    for (std::size_t c = 0; known && c < sweeps.columns.size(); ++c) {
      put(sweeps.columns[c], sweeps.rows[*known].cells[c]);
    }
    for (std::size_t c = 0; c < sweep.columns.size(); ++c) put(sweep.columns[c], row.cells[c]);
  }
}

/// Of one file of the folder.
struct SweepColumns {
  std::string file;
  std::vector<std::string> columns;
  std::optional<std::string> speed;  // the optical probe's where it read anything, else the electrical one
};

constexpr const char* kSpeed = "Motor Speed";  // of files of which some have the one and some the other

bool has_nonzero(const Sheet& sheet, const std::string& column) {
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    if (sheet.number(row, column).value_or(0) != 0) return true;
  }
  return false;
}

/// The first column whose header starts so and that is not all zero; an optical probe that was not fitted
/// reads 0.
std::optional<std::string> column_starting(const Sheet& sheet, std::string_view start) {
  for (const std::string& column : sheet.columns) {
    if (column.starts_with(start) && has_nonzero(sheet, column)) return column;
  }
  return {};
}

std::optional<std::string> speed_column(const Sheet& sheet) {
  const auto optical = column_starting(sheet, "Motor Optical Speed");
  return optical ? optical : column_starting(sheet, "Motor Electrical Speed");
}

/// Every file must have the response under the header that the first one has.
void check_thrust(const std::string& thrust, const std::vector<SweepColumns>& sweeps) {
  for (const SweepColumns& sweep : sweeps) {
    if (std::ranges::find(sweep.columns, thrust) != sweep.columns.end()) continue;
    const auto other = std::ranges::find_if(
        sweep.columns, [](const std::string& column) { return column.starts_with("Thrust"); });
    throw InputError::at(sweep.file, 1, "no column {}, which other files of the folder have{}", thrust,
                         other == sweep.columns.end()
                             ? ""
                             : fmt::format("; {} is in another unit or by another name", *other));
  }
}

/// The speed's column of all files. Where they differ it is a new one, with what each file's own says.
std::optional<std::string> common_speed(Sheet& all, const std::vector<SweepColumns>& sweeps,
                                        const SweepOptions& options) {
  std::map<std::string, std::string> columns;  // by file
  const SweepColumns* first = nullptr;
  const SweepColumns* other = nullptr;
  for (const SweepColumns& sweep : sweeps) {
    if (!sweep.speed) continue;
    columns[sweep.file] = *sweep.speed;
    if (first == nullptr) first = &sweep;
    if (*sweep.speed != *first->speed) other = &sweep;
  }
  if (first == nullptr) return speed_column(all);
  if (other == nullptr) return first->speed;
  const bool one_unit = unit_in_header(*first->speed) == unit_in_header(*other->speed);
  if (!one_unit || options.pole_count)
    throw InputError::at(other->file, 1, "{}its speed is {}, that of {} is {}: import them apart",
                         one_unit ? "--pole-count: " : "", *other->speed, first->file, *first->speed);
  const std::string name = fmt::format("{} ({})", kSpeed, unit_in_header(*first->speed));
  const std::size_t index = all.ensure(name);
  for (std::size_t row = 0; row < all.rows.size(); ++row) {
    const auto found = columns.find(all.rows[row].file);
    if (found != columns.end()) all.rows[row].cells[index] = all.text(row, found->second);
  }
  return name;
}

/// A text as TOML writes it: names of files and columns may hold quotes and backslashes.
std::string toml_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (const auto code = static_cast<unsigned char>(c); code < 0x20 || code == 0x7F)
      out += fmt::format("\\u{:04X}", code);
    else
      out += (c == '"' || c == '\\' ? "\\" : "") + std::string(1, c);
  }
  return out + "\"";
}

std::string column_toml(std::string_view section, const std::string& column, std::string_view meaning) {
  return fmt::format("\n{}\ncolumn = {}\nunit = {}\n{}", section, toml_text(column),
                     toml_text(unit_in_header(column)),
                     meaning.empty() ? "" : fmt::format("meaning = \"{}\"\n", meaning));
}

/// By the options' names: whoever gave them never sees the schema that they go into.
void check_options(const SweepOptions& options) {
  constexpr double kSmallest_m = 0.01, kLargest_m = 10;
  if (const auto diameter_m = options.propeller_diameter_m;
      diameter_m && !(*diameter_m >= kSmallest_m && *diameter_m <= kLargest_m))
    throw InputError(fmt::format("--propeller-diameter-m {:g}: must be from {:g} to {:g}, in metres{}",
                                 *diameter_m, kSmallest_m, kLargest_m,
                                 *diameter_m > kLargest_m ? "; is it in millimetres?" : ""));
  if (const auto poles = options.pole_count; poles && (*poles < 2 || *poles > 200 || *poles % 2 != 0))
    throw InputError(fmt::format("--pole-count {}: must be an even number from 2 to 200", *poles));
}

std::string sweep_schema(Sheet& all, const std::vector<SweepColumns>& sweeps, const SweepOptions& options,
                         const std::string& source) {
  const auto thrust = column_starting(all, "Thrust");
  if (!thrust)
    throw InputError::in(source, "no column Thrust (unit) with a value; is this an RCbenchmark sweep?");
  check_thrust(*thrust, sweeps);
  const auto speed = common_speed(all, sweeps, options);
  const std::string group = all.find("group") ? "group" : "file";
  std::string toml =
      fmt::format("format = \"{}\"\nname = {}\ngroups = [\"{}\"]\nblocks = \"file\"\n", kTableFormat,
                  toml_text(std::filesystem::path(source).filename().string()), group);
  toml += column_toml("[response]", *thrust, "thrust_N");
  if (speed) {
    toml += column_toml("[speed]", *speed, "");
    if (options.pole_count) toml += fmt::format("electrical = true\npole_count = {}\n", *options.pole_count);
  } else if (options.pole_count) {
    throw InputError::in(source,
                         "--pole-count: no column Motor Optical Speed or Motor Electrical Speed has a value");
  }
  if (all.find("propeller_diameter_m")) {
    toml += "\n[propeller]\ndiameter_column = \"propeller_diameter_m\"\ndiameter_unit = \"m\"\n";
  } else if (options.propeller_diameter_m) {
    toml += fmt::format("\n[propeller]\ndiameter_m = {}\n", *options.propeller_diameter_m);
  }
  for (const auto& [start, meaning] :
       {std::pair<std::string_view, std::string_view>{"Voltage", "supply_voltage_V"},
        {"Current", ""},
        {"ESC signal", ""},
        {"Electrical Power", ""}}) {
    if (const auto column = column_starting(all, start))
      toml += column_toml("[[covariates]]", *column, meaning);
  }
  return toml;
}

/// A log has a row for every reading of any sensor, and the cell's are the fewest: how many rows have none,
/// which go. A file without any is refused.
std::size_t leave_out_rows_without(const std::string& response, Sheet& all) {
  all.require(response);
  std::map<std::string, bool> has;
  std::vector<Sheet::Row> kept;
  for (std::size_t row = 0; row < all.rows.size(); ++row) {
    const bool read = all.number(row, response).has_value();
    has[all.rows[row].file] |= read;
    if (read) kept.push_back(all.rows[row]);
  }
  for (const auto& [file, any] : has)
    if (!any) throw InputError::in(file, "no row has a value of {}, which is the response", response);
  const std::size_t without = all.rows.size() - kept.size();
  all.rows = std::move(kept);
  return without;
}

}  // namespace

ObservationTable read_rcbenchmark(const std::filesystem::path& source, const SweepOptions& options) {
  check_options(options);
  Sheet sweeps;
  if (!options.sweeps_csv.empty()) {
    sweeps = read_csv(options.sweeps_csv);
    sweeps.require("file");
  }
  Sheet all{.file = source.string(), .columns = {"file"}, .rows = {}};
  std::vector<SweepColumns> read;
  for (const auto& path : sweep_files(source)) {
    const Sheet sweep = read_csv(path, kMessage);
    const std::string file = path.filename().string();
    append_sweep(all, sweep, sweeps, file);
    if (options.schema.empty()) read.push_back({file, sweep.columns, speed_column(sweep)});
  }
  const std::string toml =
      options.schema.empty() ? sweep_schema(all, read, options, source.string()) : read_text(options.schema);
  const std::string name = options.schema.empty() ? "the headers' schema" : options.schema.string();
  const TableSchema parsed = parse_table_schema(toml, name);
  const std::size_t without = leave_out_rows_without(parsed.response.column, all);
  ObservationTable table = read_observations(with_days_for_dates(std::move(all), parsed), parsed);
  table.without_response = without;
  return table;
}

}  // namespace tunnelrig
