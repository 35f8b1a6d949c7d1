#include "datasets/csv.h"

#include "datasets/error.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <system_error>

#include <unistd.h>

namespace tunnelrig {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// A header that ends with CR alone would have all rows in it.
void require_line_feeds(std::string_view text, const std::string& file) {
  const auto first = text.find('\r');
  if (first >= text.find('\n') || first + 1 >= text.size() || text[first + 1] == '\n') return;
  std::ptrdiff_t alone = 0;
  for (auto at = first; at != std::string_view::npos; at = text.find('\r', at + 1))
    alone += text.substr(at + 1, 1) == "\n" ? 0 : 1;
  if (alone > std::ranges::count(text, '\n'))
    throw InputError::in(file, "its lines end with CR alone; save it with LF or CR LF");
  throw InputError::in(file,
                       "line 1 has a CR before its end; save it with LF or CR LF at the ends of lines alone");
}

/// Splits CSV text into records of cells; one call of `record` reads up to the end of one record.
class Scanner {
 public:
  Scanner(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  bool at_end() const { return at_ == text_.size(); }
  int line() const { return line_; }

  std::vector<std::string> record() {
    std::vector<std::string> cells;
    do {
      cells.push_back(cell());
    } while (take(','));
    take('\r');
    if (!take('\n') && !at_end()) {
      throw InputError::at(file_, line_, "text after a closing quote; a quote inside a cell is doubled");
    }
    ++line_;
    return cells;
  }

 private:
  bool take(char wanted) {
    if (at_end() || text_[at_] != wanted) return false;
    ++at_;
    return true;
  }

  std::string cell() {
    if (!take('"')) {
      const auto end = std::min(text_.find_first_of(",\n", at_), text_.size());
      std::string_view cell = text_.substr(at_, end - at_);
      if (cell.ends_with('\r') && (end == text_.size() || text_[end] == '\n')) cell.remove_suffix(1);
      at_ = end;
      return std::string(cell);
    }
    const int opened = line_;
    std::string cell;
    while (true) {
      if (at_end()) throw InputError::at(file_, opened, "a quote is opened here and never closed");
      const char c = text_[at_++];
      if (c == '"' && !take('"')) return cell;
      if (c == '\n') ++line_;
      cell.push_back(c);
    }
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  int line_ = 1;
};

/// The length of the UTF-8 sequence at the start of `text`; 0 where it is none (RFC 3629, section 4).
std::size_t utf8_length(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  if (length == 0 || text.size() < length) return 0;
  // Of the second byte: no overlong form, no half of a UTF-16 pair, nothing above U+10FFFF.
  unsigned char lowest = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
  unsigned char highest = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
  for (std::size_t i = 1; i < length; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte < lowest || byte > highest) return 0;
    lowest = 0x80;
    highest = 0xBF;
  }
  return length;
}

void check_encoding(std::string_view text, const std::string& file) {
  int line = 1;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0)
      throw InputError::at(
          file, line, "this is not UTF-8 text: save it as UTF-8 (a letter like ° or µ in another encoding?)");
    if (text[0] == '\0') throw InputError::at(file, line, "this is not a text file (it holds a byte 0)");
    if (text[0] == '\n') ++line;
    text.remove_prefix(length);
  }
}

void check_header(const Sheet& sheet, bool only_line) {
  for (std::size_t i = 0; i < sheet.columns.size(); ++i) {
    if (std::find(sheet.columns.begin(), sheet.columns.begin() + static_cast<std::ptrdiff_t>(i),
                  sheet.columns[i]) != sheet.columns.begin() + static_cast<std::ptrdiff_t>(i) &&
        !sheet.columns[i].empty()) {
      throw InputError::at(sheet.file, 1, "column {} stands twice in the header{}", sheet.columns[i],
                           only_line ? "; the file is this one line: has it lost its line ends?" : "");
    }
  }
}

}  // namespace

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::optional<double> parse_number(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

std::optional<std::size_t> Sheet::find(std::string_view column) const {
  const auto found = std::find(columns.begin(), columns.end(), column);
  if (found == columns.end()) return {};
  return static_cast<std::size_t>(found - columns.begin());
}

std::string_view separator_advice(const std::vector<std::string>& columns) {
  const auto count = [&](char separator) {
    std::size_t found = 0;
    for (const std::string& column : columns)
      found += static_cast<std::size_t>(std::count(column.begin(), column.end(), separator));
    return found;
  };
  if (count(';') >= columns.size()) return "; the header looks separated by semicolons: commas are needed";
  if (count('\t') >= columns.size()) return "; the header looks separated by tabs: commas are needed";
  return "";
}

std::size_t Sheet::require(std::string_view column) const {
  if (const auto found = find(column)) return *found;
  throw InputError::at(file, 1, "the required column {} is missing{}", column, separator_advice(columns));
}

std::size_t Sheet::ensure(std::string_view column) {
  if (const auto found = find(column)) return *found;
  columns.emplace_back(column);
  for (Row& row : rows) row.cells.emplace_back();
  return columns.size() - 1;
}

const std::string& Sheet::text(std::size_t row, std::string_view column) const {
  static const std::string empty;
  const auto index = find(column);
  return index ? rows[row].cells[*index] : empty;
}

std::string Sheet::place(std::size_t row) const {
  return fmt::format("{}:{}", rows[row].file.empty() ? file : rows[row].file, rows[row].line);
}

std::string Sheet::where(std::size_t row, std::string_view column) const {
  return fmt::format("{}: column {}", place(row), column);
}

namespace {

/// What else to do about a cell that is no number.
std::string_view advice(std::string_view cell, bool first_row) {
  const bool digits = cell.find_first_of("0123456789") != std::string_view::npos;
  if (digits && cell.find(',') != std::string_view::npos &&
      cell.find_first_not_of("0123456789+-., ") == std::string_view::npos)
    return "; a decimal comma: write a point";
  return !digits && first_row ? "; a row of units: take it out" : "";
}

}  // namespace

std::optional<double> Sheet::number(std::size_t row, std::string_view column) const {
  const std::string& cell = text(row, column);
  if (trimmed(cell).empty()) return {};
  if (const auto value = parse_number(cell)) return value;
  throw InputError(fmt::format("{}: '{}' is not a finite decimal number (not recorded: leave it empty{})",
                               where(row, column), cell, advice(cell, row == 0)));
}

double Sheet::require_number(std::size_t row, std::string_view column) const {
  require(column);
  const std::string& cell = text(row, column);
  if (const auto value = parse_number(cell)) return *value;
  throw InputError(
      fmt::format("{}: a number is required here{}", where(row, column),
                  trimmed(cell).empty() ? "" : fmt::format(", and '{}' is no finite decimal one", cell)));
}

double Sheet::require_number_within(std::size_t row, std::string_view column, double most) const {
  const double value = require_number(row, column);
  if (std::abs(value) > most)
    throw InputError(
        fmt::format("{}: {:g} is beyond all that is measured ({:g})", where(row, column), value, most));
  return value;
}

int Sheet::require_integer(std::size_t row, std::string_view column, int lowest, int highest) const {
  const double value = require_number(row, column);
  if (value != std::floor(value) || value < lowest || value > highest) {
    throw InputError(fmt::format("{}: '{}' is not a whole number from {} to {}", where(row, column),
                                 text(row, column), lowest, highest));
  }
  return static_cast<int>(value);
}

namespace {

/// Puts together what commas within the free text have parted.
void join_free_text(std::vector<std::string>& cells, const std::vector<std::string>& columns,
                    std::string_view free_text) {
  const auto column = std::find(columns.begin(), columns.end(), free_text);
  const bool last =
      column != columns.end() &&
      std::all_of(column + 1, columns.end(), [](const std::string& name) { return name.empty(); });
  if (!last || cells.size() <= columns.size()) return;
  const auto at = cells.begin() + (column - columns.begin());
  const auto end = at + 1 + static_cast<std::ptrdiff_t>(cells.size() - columns.size());
  for (auto part = at + 1; part != end; ++part) *at += "," + *part;
  cells.erase(at + 1, end);
}

}  // namespace

Sheet parse_csv(std::string_view text, const std::string& file, std::string_view free_text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  check_encoding(text, file);
  Sheet sheet{.file = file, .columns = {}, .rows = {}};
  require_line_feeds(text, file);
  Scanner scanner(text, file);
  if (scanner.at_end()) throw InputError::at(file, 1, "the file is empty; a header row is required");
  sheet.columns = scanner.record();
  for (std::string& column : sheet.columns) column = trimmed(column);
  check_header(sheet, scanner.at_end());
  while (!scanner.at_end()) {
    const int line = scanner.line();
    std::vector<std::string> cells = scanner.record();
    if (cells.size() == 1 && trimmed(cells[0]).empty() && sheet.columns.size() > 1) continue;
    if (!free_text.empty()) join_free_text(cells, sheet.columns, free_text);
    if (cells.size() != sheet.columns.size()) {
      const std::string_view advice = separator_advice(sheet.columns);
      throw InputError::at(file, line, "{} cells where the header has {} columns{}", cells.size(),
                           sheet.columns.size(),
                           !advice.empty() || sheet.columns.size() > 1
                               ? advice
                               : "; line 1 must be the header: is something else above it?");
    }
    sheet.rows.push_back({std::move(cells), line});
  }
  return sheet;
}

Sheet read_csv(const std::filesystem::path& path, std::string_view free_text) {
  return parse_csv(read_text(path), path.string(), free_text);
}

std::string csv_cell(std::string_view text) {
  // A byte order mark that belongs to the text must not come to stand at the start of the file.
  if (text.find_first_of(",\"\r\n") == std::string_view::npos && !text.starts_with(kByteOrderMark))
    return std::string(text);
  std::string out = "\"";
  for (const char c : text) out.append(c == '"' ? 2 : 1, c);
  return out + "\"";
}

std::string format_csv(const Sheet& sheet) {
  std::string out;
  const auto append = [&out](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) out += (i > 0 ? "," : "") + csv_cell(cells[i]);
    out.push_back('\n');
  };
  append(sheet.columns);
  for (const Sheet::Row& row : sheet.rows) append(row.cells);
  return out;
}

std::string absence(const std::error_code& error, std::string_view otherwise) {
  return error == std::errc::permission_denied ? "cannot be read: " + error.message()
                                               : std::string(otherwise);
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw InputError::in(folder.string(), "cannot be made: {}", error.message());
  if (::access(folder.c_str(), W_OK) != 0)
    throw InputError::in(folder.string(), "cannot be written to: {}", std::generic_category().message(errno));
}

std::string read_text(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw InputError::in(path.string(), "is a folder where a file is expected");
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError::in(path.string(), "cannot be read: {}", std::generic_category().message(errno));
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

namespace {

[[noreturn]] void cannot_write(const std::filesystem::path& path, const std::string& reason) {
  throw InputError::in(path.string(), "cannot be written: {}", reason);
}

/// A campaign file is what nobody means to write a table over.
bool is_data_base(const std::filesystem::path& path) {
  constexpr std::string_view kMagic = "SQLite format 3";
  std::string begins(kMagic.size(), '\0');
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;  // a pipe would wait for its writer
  std::ifstream in(path, std::ios::binary);
  return in.read(begins.data(), static_cast<std::streamsize>(begins.size())) && begins == kMagic;
}

bool put(const std::filesystem::path& path, std::string_view text) {
  std::ofstream out(path, std::ios::binary);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  return static_cast<bool>(out);
}

}  // namespace

void keep_campaign_files(const std::filesystem::path& path) {
  if (is_data_base(path)) cannot_write(path, "it is a campaign file; write to another name");
}

std::ofstream open_to_write(const std::filesystem::path& path) {
  keep_campaign_files(path);
  std::ofstream out(path, std::ios::binary);
  if (!out) cannot_write(path, std::generic_category().message(errno));
  return out;
}

void write_text(const std::filesystem::path& path, std::string_view text) {
  std::error_code error;
  if (std::filesystem::is_other(std::filesystem::status(path, error))) {
    if (!put(path, text)) cannot_write(path, std::generic_category().message(errno));
    return;
  }
  std::filesystem::path target = path;
  constexpr int kMostLinks = 40;
  for (int links = 0; links < kMostLinks && std::filesystem::is_symlink(target, error); ++links)
    target = target.parent_path() / std::filesystem::read_symlink(target, error);
  keep_campaign_files(target);
  std::filesystem::path partial = target;
  partial += fmt::format(".{}.part", ::getpid());
  const bool whole = put(partial, text);
  const int reason = errno;
  error.clear();
  if (whole) std::filesystem::rename(partial, target, error);
  if (whole && !error) return;
  const std::string why = error ? error.message() : std::generic_category().message(reason);
  std::filesystem::remove(partial, error);
  cannot_write(path, why);
}

}  // namespace tunnelrig
