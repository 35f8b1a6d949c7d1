// CSV as it stands in the file: every cell's text is kept, with the line it came from.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace tunnelrig {

/// A table of text with a header row (RFC 4180, comma separators, UTF-8). Values are parsed on access, so
/// that export writes back exactly what was read and every message can name file, line and column.
struct Sheet {
  struct Row {
    std::vector<std::string> cells;  // one per column
    int line = 0;                    // 1-based line of the file that the row starts on
    std::string file = {};           // where that is another than the sheet's: files that were stacked
  };

  std::string file;  // as messages name it
  std::vector<std::string> columns;
  std::vector<Row> rows;

  std::optional<std::size_t> find(std::string_view column) const;

  /// The index of a column that must be there; throws InputError naming file and column.
  std::size_t require(std::string_view column) const;

  /// The column's index, appending an empty column where it is missing.
  std::size_t ensure(std::string_view column);

  /// The cell's text, empty where the column is missing.
  const std::string& text(std::size_t row, std::string_view column) const;

  /// The cell as a finite number, or nothing where it is empty or the column is missing.
  /// Throws InputError naming file, line and column where it is no number.
  std::optional<double> number(std::size_t row, std::string_view column) const;

  /// As `number`, for a cell that must not be empty.
  double require_number(std::size_t row, std::string_view column) const;

  /// As `require_number`, for a number that is at most `most` in size: sums of its squares must stay finite.
  double require_number_within(std::size_t row, std::string_view column, double most) const;

  /// As `require_number`, for whole numbers from `lowest` to `highest`.
  int require_integer(std::size_t row, std::string_view column, int lowest, int highest) const;

  /// "runs.csv:12", for messages.
  std::string place(std::size_t row) const;

  /// "runs.csv:12: column speed_rpm", for messages.
  std::string where(std::size_t row, std::string_view column) const;
};

/// "" where commas separate the header's cells, as they must; else what to do about it, for messages.
std::string_view separator_advice(const std::vector<std::string>& columns);

/// Parses CSV text. Throws InputError for a missing header, a column named twice or not at all, a row of
/// the wrong length, an unclosed quote, or text that is not UTF-8.
/// `free_text`: a column, the last with a name, whose text may hold commas that no quotes protect.
Sheet parse_csv(std::string_view text, const std::string& file, std::string_view free_text = {});

/// Reads and parses a file; messages name its path as given.
Sheet read_csv(const std::filesystem::path& path, std::string_view free_text = {});

/// A text as a cell of a CSV: in quotes where it needs them.
std::string csv_cell(std::string_view text);

/// RFC 4180 text of the sheet, quoting only the cells that need it, lines ending in \n.
std::string format_csv(const Sheet& sheet);

/// Whether a text is UTF-8 (RFC 3629): what can be stored, shown and written as JSON.
bool is_utf8(std::string_view text);

/// Strict decimal number (no blanks inside, point as decimal mark, finite), or nothing.
std::optional<double> parse_number(std::string_view text);

/// What to say of a path where nothing could be found: that it may not be looked at, or `otherwise`.
std::string absence(const std::error_code& error, std::string_view otherwise);

/// Makes a folder to write to, where it is missing. Throws InputError naming it where that cannot be, or
/// nothing can be written in it.
void make_folder(const std::filesystem::path& folder);

/// Whole file as text; throws InputError where it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// Throws InputError where a campaign file stands at a path that is to be written to.
void keep_campaign_files(const std::filesystem::path& path);

/// Opens a file to write bytes to as they come. Throws InputError where that cannot be, and where a campaign
/// file is in the way.
std::ofstream open_to_write(const std::filesystem::path& path);

/// Writes a text file through a temporary one and a rename, so that it is whole or absent. Where the path
/// leads to a device or a pipe, that takes the text; where it is a link to a file, the link stays. Throws
/// InputError where it cannot be written, and where a campaign file is in the way.
void write_text(const std::filesystem::path& path, std::string_view text);

}  // namespace tunnelrig
