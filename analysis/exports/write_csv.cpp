// CSV: a file per table, a file per recording, a file per array (docs/exports.md).
#include "analysis/exports/folder_files.h"
#include "analysis/exports/output_file.h"
#include "analysis/exports/writer.h"
#include "datasets/csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <future>
#include <memory>
#include <string>

#include <fmt/format.h>

namespace tunnelrig::exports {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLines = 1 << 20;   // bytes that are passed on at a time
constexpr std::size_t kLongestCell = 32;  // of a number, with its comma

std::string text_of(double value) { return std::isfinite(value) ? fmt::format("{}", value) : std::string(); }
std::string text_of(std::int64_t value) { return fmt::format("{}", value); }
std::string text_of(std::uint8_t value) { return value != 0 ? "1" : "0"; }
std::string text_of(const std::string& value) { return value; }

/// Appends the samples of one frame, a comma behind each.
template <typename Number>
char* append_samples(const std::byte* from, std::size_t columns, char* to) {
  for (std::size_t c = 0; c < columns; ++c) {
    Number value;
    std::memcpy(&value, from + c * sizeof(value), sizeof(value));
    to = std::to_chars(to, to + kLongestCell, value).ptr;
    *to++ = ',';
  }
  return to;
}

/// The text of an int16 with its comma, "-32768," at the longest.
struct CountText {
  std::array<char, 7> text{};
  std::uint8_t size = 0;
};

std::vector<CountText> make_count_texts() {
  std::vector<CountText> texts(1 << 16);
  for (int count = -32768; count <= 32767; ++count) {
    CountText& made = texts[static_cast<std::uint16_t>(count)];
    char* end = std::to_chars(made.text.data(), made.text.data() + made.text.size(), count).ptr;
    *end++ = ',';
    made.size = static_cast<std::uint8_t>(end - made.text.data());
  }
  return texts;
}

/// Most of an export is counts; looked up they take a quarter of the time that it takes to divide them by
/// ten.
template <>
char* append_samples<std::int16_t>(const std::byte* from, std::size_t columns, char* to) {
  static const std::vector<CountText> texts = make_count_texts();
  for (std::size_t c = 0; c < columns; ++c) {
    std::uint16_t bits = 0;
    std::memcpy(&bits, from + c * sizeof(bits), sizeof(bits));
    const CountText& count = texts[bits];
    std::memcpy(to, count.text.data(), count.text.size());  // kLongestCell leaves room behind the comma
    to += count.size;
  }
  return to;
}

using Append = char* (*)(const std::byte*, std::size_t, char*);

Append append_of(Element element) {
  switch (element) {
    case Element::kInt16:
      return append_samples<std::int16_t>;
    case Element::kUInt16:
      return append_samples<std::uint16_t>;
    case Element::kUInt32:
      return append_samples<std::uint32_t>;
    case Element::kUInt64:
      return append_samples<std::uint64_t>;
    case Element::kFloat32:
      return append_samples<float>;
    case Element::kFloat64:
      return append_samples<double>;
  }
  return nullptr;
}

/// How the samples of a series become text.
struct SeriesText {
  Append append;
  std::size_t columns, frame_size;
};

class CsvWriter : public Writer {
 public:
  explicit CsvWriter(fs::path folder) : folder_(std::move(folder)) { fs::create_directory(folder_ / "raw"); }

  void begin(const Recording& recording) override {
    file_ = std::make_shared<OutputFile>(folder_ / "raw" / (recording.key + ".csv"));
    std::string header;
    columns_ = 0;
    series_.clear();
    for (const Series& series : recording.series) {
      series_.push_back({append_of(series.element), series.columns, series.frame_size()});
      for (std::size_t c = 0; c < series.columns; ++c)
        header += (columns_++ > 0 ? "," : "") + series.column_name(c);
    }
    header += '\n';
    begin_lines();
    end_ = std::copy(header.begin(), header.end(), end_);
  }

  void block(const Block& block) override {
    char* at = end_;
    for (std::size_t frame = 0; frame < block.frames; ++frame) {
      for (std::size_t s = 0; s < series_.size(); ++s) {
        const SeriesText& text = series_[s];
        at = text.append(block.series[s].data() + frame * text.frame_size, text.columns, at);
      }
      at[-1] = '\n';
      if (at - lines_.data() > static_cast<std::ptrdiff_t>(kLines)) {
        pass_on(at, false);
        at = end_;
      }
    }
    end_ = at;
  }

  void end() override {
    pass_on(end_, true);
    file_.reset();
  }

  void table(const Table& table) override {
    Sheet sheet;
    sheet.rows.resize(table.rows());
    for (const Column& column : table.columns) {
      sheet.columns.push_back(column.name);
      std::visit(
          [&](const auto& values) {
            for (std::size_t i = 0; i < values.size(); ++i) sheet.rows[i].cells.push_back(text_of(values[i]));
          },
          column.values);
    }
    write_file(folder_ / (table.name + ".csv"), format_csv(sheet));
  }

  void group(const ArrayGroup& group) override {
    fs::create_directory(folder_ / group.name);
    for (const Array& array : group.arrays) {
      std::string text;
      for (std::size_t i = 0; i < array.values.size(); ++i) {
        text += text_of(array.values[i]);
        text += (i + 1) % array.columns() == 0 ? '\n' : ',';
      }
      write_file(folder_ / group.name / (array.name + ".csv"), text);
    }
  }

  void texts(const std::vector<Attachment>& texts) override { write_texts(folder_, texts); }

  void finish(const std::vector<std::pair<std::string, std::string>>& provenance) override {
    settle();
    write_provenance(folder_, provenance);
  }

 private:
  void begin_lines() {
    lines_.resize(kLines + columns_ * kLongestCell);
    end_ = lines_.data();
  }

  /// Writes the lines that end at `end`, the file's last ones or not, while the next are made, of this
  /// recording or of the one after it: both take about as long.
  void pass_on(const char* end, bool last) {
    settle();
    written_.swap(lines_);
    const std::string_view text(written_.data(), static_cast<std::size_t>(end - written_.data()));
    writing_ = std::async(std::launch::async, [file = file_, text, last] {
      file->write(text);
      if (last) file->close();
    });
    begin_lines();
  }

  void settle() {
    if (writing_.valid()) writing_.get();
  }

  fs::path folder_;
  std::shared_ptr<OutputFile> file_;
  std::vector<SeriesText> series_;
  std::size_t columns_ = 0;
  std::vector<char> lines_, written_;
  char* end_ = nullptr;        // of the lines that are in lines_
  std::future<void> writing_;  // of written_; the last member, so that it is waited for before the others go
};

}  // namespace

std::unique_ptr<Writer> make_csv_writer(const std::filesystem::path& folder) {
  return std::make_unique<CsvWriter>(folder);
}

}  // namespace tunnelrig::exports
