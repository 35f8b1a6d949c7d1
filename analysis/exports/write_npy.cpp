// NumPy: .npy files with a JSON of units beside each (docs/exports.md).
#include "analysis/exports/folder_files.h"
#include "analysis/exports/output_file.h"
#include "analysis/exports/unicode.h"
#include "analysis/exports/writer.h"
#include "datasets/npy.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::exports {
namespace {

namespace fs = std::filesystem;
using NpyJson = nlohmann::ordered_json;

const char* descr_of(Element element) {
  constexpr std::array<const char*, 6> kDescr = {"'<i2'", "'<u2'", "'<u4'", "'<u8'", "'<f4'", "'<f8'"};
  return kDescr[static_cast<std::size_t>(element)];
}

/// A column as fixed-size cells, as a structured array holds it.
struct Cells {
  std::string descr;
  std::size_t size = 0;
  std::vector<std::byte> bytes;
};

template <typename Value>
Cells cells_of(const std::vector<Value>& values, const char* descr) {
  const auto bytes = std::as_bytes(std::span(values));
  return {descr, sizeof(Value), {bytes.begin(), bytes.end()}};
}

Cells cells_of(const Numbers& values) { return cells_of(values, "'<f8'"); }
Cells cells_of(const Integers& values) { return cells_of(values, "'<i8'"); }
Cells cells_of(const Flags& values) { return cells_of(values, "'|b1'"); }

Cells cells_of(const Texts& values) {
  std::vector<std::u32string> wide;
  std::size_t longest = 1;
  for (const std::string& value : values) longest = std::max(longest, wide.emplace_back(utf32(value)).size());
  Cells cells{fmt::format("'<U{}'", longest), longest * sizeof(char32_t), {}};
  cells.bytes.resize(cells.size * values.size());
  for (std::size_t i = 0; i < wide.size(); ++i) {
    if (!wide[i].empty())
      std::memcpy(cells.bytes.data() + i * cells.size, wide[i].data(), wide[i].size() * sizeof(char32_t));
  }
  return cells;
}

class NpyWriter : public Writer {
 public:
  explicit NpyWriter(fs::path folder) : folder_(std::move(folder)) { fs::create_directory(folder_ / "raw"); }

  void begin(const Recording& recording) override {
    NpyJson json{{"run", recording.run},
                 {"location", recording.location},
                 {"sample_rate_hz", recording.sample_rate_hz},
                 {"frames", recording.frames}};
    for (const Series& series : recording.series) {
      json["series"][series.name] = {{"unit", series.unit}, {"meaning", series.meaning}};
      const std::uint64_t shape[] = {recording.frames, series.columns};
      files_.emplace_back(folder_ / "raw" / fmt::format("{}.{}.npy", recording.key, series.name));
      files_.back().write(
          format_npy_header(descr_of(series.element), std::span(shape).first(series.columns > 1 ? 2 : 1)));
    }
    write_json(folder_ / "raw" / (recording.key + ".json"), json);
  }

  void block(const Block& block) override {
    for (std::size_t s = 0; s < files_.size(); ++s) files_[s].write(block.series[s]);
  }

  void end() override {
    for (OutputFile& file : files_) file.close();
    files_.clear();
  }

  void table(const Table& table) override {
    NpyJson json{{"meaning", table.meaning}, {"columns", NpyJson::object()}};
    std::vector<Cells> columns;
    std::string descr;
    for (const Column& column : table.columns) {
      json["columns"][column.name] = {{"unit", column.unit}, {"meaning", column.meaning}};
      columns.push_back(std::visit([](const auto& values) { return cells_of(values); }, column.values));
      descr += fmt::format("('{}', {}), ", column.name, columns.back().descr);
    }
    const std::uint64_t rows = table.rows();
    OutputFile file(folder_ / (table.name + ".npy"));
    file.write(format_npy_header("[" + descr + "]", std::span(&rows, 1)));
    for (std::size_t row = 0; row < rows; ++row) {
      for (const Cells& cells : columns)
        file.write(std::span(cells.bytes).subspan(row * cells.size, cells.size));
    }
    file.close();
    write_json(folder_ / (table.name + ".json"), json);
  }

  void group(const ArrayGroup& group) override {
    fs::create_directory(folder_ / group.name);
    NpyJson json{{"meaning", group.meaning}};
    for (const Array& array : group.arrays) {
      json["arrays"][array.name] = {{"unit", array.unit}, {"meaning", array.meaning}};
      const std::vector<std::uint64_t> shape(array.shape.begin(), array.shape.end());
      OutputFile file(folder_ / group.name / (array.name + ".npy"));
      file.write(format_npy_header("'<f8'", shape));
      file.write(std::as_bytes(std::span(array.values)));
      file.close();
    }
    write_json(folder_ / (group.name + ".json"), json);
  }

  void texts(const std::vector<Attachment>& texts) override { write_texts(folder_, texts); }

  void finish(const std::vector<std::pair<std::string, std::string>>& provenance) override {
    write_provenance(folder_, provenance);
  }

 private:
  fs::path folder_;
  std::deque<OutputFile> files_;  // one per series of the recording
};

}  // namespace

std::unique_ptr<Writer> make_npy_writer(const std::filesystem::path& folder) {
  return std::make_unique<NpyWriter>(folder);
}

}  // namespace tunnelrig::exports
