// CSV: a file per table, a file per recording, a file per array (docs/exports.md).
#include "analysis/exports/output_file.h"
#include "analysis/exports/writer.h"
#include "datasets/csv.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include <nlohmann/json.hpp>

namespace tunnelrig::exports {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestCell = 32;  // of a number, with its comma

std::string text_of(double value) { return std::isnan(value) ? std::string() : fmt::format("{}", value); }
std::string text_of(std::int64_t value) { return fmt::format("{}", value); }
std::string text_of(std::uint8_t value) { return value != 0 ? "1" : "0"; }
std::string text_of(const std::string& value) { return value; }

/// Appends one sample and the character behind it.
template <typename Number>
char* append_sample(const std::byte* from, char* to, char behind) {
  Number value;
  std::memcpy(&value, from, sizeof(value));
  to = std::to_chars(to, to + kLongestCell, value).ptr;
  *to++ = behind;
  return to;
}

using Append = char* (*)(const std::byte*, char*, char);

Append append_of(Element element) {
  switch (element) {
    case Element::kInt16:
      return append_sample<std::int16_t>;
    case Element::kUInt16:
      return append_sample<std::uint16_t>;
    case Element::kUInt32:
      return append_sample<std::uint32_t>;
    case Element::kUInt64:
      return append_sample<std::uint64_t>;
    case Element::kFloat32:
      return append_sample<float>;
    case Element::kFloat64:
      return append_sample<double>;
  }
  return nullptr;
}

class CsvWriter : public Writer {
 public:
  explicit CsvWriter(fs::path folder) : folder_(std::move(folder)) { fs::create_directory(folder_ / "raw"); }

  void begin(const Recording& recording) override {
    series_ = recording.series;
    file_.emplace(folder_ / "raw" / (recording.key + ".csv"));
    std::string header;
    columns_ = 0;
    for (const Series& series : series_) {
      for (std::size_t c = 0; c < series.columns; ++c)
        header += (columns_++ > 0 ? "," : "") + series.column_name(c);
    }
    file_->write(header + "\n");
  }

  void block(const Block& block) override {
    line_.resize(columns_ * kLongestCell);
    for (std::size_t frame = 0; frame < block.frames; ++frame) {
      char* at = line_.data();
      for (std::size_t s = 0; s < series_.size(); ++s) {
        const Append append = append_of(series_[s].element);
        const std::size_t size = size_of(series_[s].element);
        const std::byte* from = block.series[s].data() + frame * series_[s].frame_size();
        for (std::size_t c = 0; c < series_[s].columns; ++c) at = append(from + c * size, at, ',');
      }
      at[-1] = '\n';
      file_->write(std::string_view(line_.data(), static_cast<std::size_t>(at - line_.data())));
    }
  }

  void end() override {
    file_->close();
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

  void texts(const std::vector<Attachment>& texts) override {
    fs::create_directory(folder_ / "texts");
    for (const Attachment& document : texts)
      write_file(folder_ / "texts" / (document.name + "." + document.extension), document.text);
  }

  void finish(const std::vector<std::pair<std::string, std::string>>& provenance) override {
    nlohmann::ordered_json json;
    for (const auto& [key, text] : provenance) json[key] = text;
    write_file(folder_ / "provenance.json",
               json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  }

 private:
  fs::path folder_;
  std::optional<OutputFile> file_;
  std::vector<Series> series_;
  std::size_t columns_ = 0;
  std::string line_;
};

}  // namespace

std::unique_ptr<Writer> make_csv_writer(const std::filesystem::path& folder) {
  return std::make_unique<CsvWriter>(folder);
}

}  // namespace tunnelrig::exports
