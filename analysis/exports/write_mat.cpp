// MATLAB level 5: a struct per table with its units beside it, a struct per recording (docs/exports.md).
#include "analysis/exports/output_file.h"
#include "analysis/exports/unicode.h"
#include "analysis/exports/writer.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <matio.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace tunnelrig::exports {
namespace {

constexpr std::size_t kMatHeader = 128;                // bytes before the first variable
constexpr std::size_t kCopied = 1 << 18;               // bytes at a time from memory to the file
constexpr std::uint64_t kLargestVariable = 1u << 31u;  // of level 5

struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

template <typename T>
T* not_null(T* made) {
  if (made == nullptr) throw std::bad_alloc();
  return made;
}

/// A matrix in the order of columns; `how` is 0 (copied) or MAT_F_DONT_COPY_DATA.
Variable matrix(const char* name, matio_classes kind, matio_types type, std::array<std::size_t, 2> shape,
                const void* data, int how = 0) {
  return Variable(not_null(Mat_VarCreate(name, kind, type, 2, shape.data(), const_cast<void*>(data), how)));
}

Variable numbers(const char* name, const double* values, std::size_t rows, std::size_t columns = 1) {
  return matrix(name, MAT_C_DOUBLE, MAT_T_DOUBLE, {rows, columns}, values);
}

/// A row of characters. MATLAB's are 16 bits wide; ASCII is written so that Octave reads it too.
Variable characters(const char* name, const std::string& text) {
  if (is_ascii(text))
    return matrix(name, MAT_C_CHAR, MAT_T_UTF8, {text.empty() ? 0u : 1u, text.size()}, text.data());
  std::u16string wide;
  for (const char32_t point : utf32(text)) {
    if (point >= 0x10000) {
      wide.push_back(static_cast<char16_t>(0xD7C0 + (point >> 10u)));
      wide.push_back(static_cast<char16_t>(0xDC00 + (point & 0x3FFu)));
    } else {
      wide.push_back(static_cast<char16_t>(point));
    }
  }
  return matrix(name, MAT_C_CHAR, MAT_T_UTF16, {1, wide.size()}, wide.data());
}

/// A struct of one element.
class Struct {
 public:
  Struct(const std::string& name, const std::vector<std::string>& fields) {
    std::vector<const char*> names;
    for (const std::string& field : fields) names.push_back(field.c_str());
    names.push_back(nullptr);  // the list's end
    constexpr std::array<std::size_t, 2> kOne = {1, 1};
    variable_.reset(not_null(Mat_VarCreateStruct2(name.c_str(), 2, kOne.data(), names.data())));
  }
  void set(const std::string& field, Variable value) {
    Mat_VarSetStructFieldByName(variable_.get(), field.c_str(), 0, value.release());
  }
  matvar_t* get() const { return variable_.get(); }
  Variable take() { return std::move(variable_); }

 private:
  Variable variable_;
};

Variable value_of(const Numbers& values) { return numbers(nullptr, values.data(), values.size()); }
template <typename Whole>
Variable value_of(const std::vector<Whole>& values) {
  // as doubles: MATLAB rounds what it computes with its integers
  const Numbers wide(values.begin(), values.end());
  return value_of(wide);
}
Variable value_of(const Texts& values) {
  std::vector<matvar_t*> cells;
  cells.reserve(values.size());
  for (const std::string& value : values) cells.push_back(characters(nullptr, value).release());
  return matrix(nullptr, MAT_C_CELL, MAT_T_CELL, {values.size(), 1}, cells.data());
}

/// What is written of a recording: whole, since the columns of a matrix follow each other.
struct Collected {
  Series series;
  std::vector<std::byte> bytes;  // column after column
};

Variable value_of(const Collected& collected, std::uint64_t frames) {
  constexpr std::array<std::pair<matio_classes, matio_types>, 6> kTypes = {{{MAT_C_INT16, MAT_T_INT16},
                                                                            {MAT_C_UINT16, MAT_T_UINT16},
                                                                            {MAT_C_UINT32, MAT_T_UINT32},
                                                                            {MAT_C_UINT64, MAT_T_UINT64},
                                                                            {MAT_C_SINGLE, MAT_T_SINGLE},
                                                                            {MAT_C_DOUBLE, MAT_T_DOUBLE}}};
  const auto [kind, type] = kTypes[static_cast<std::size_t>(collected.series.element)];
  return matrix(nullptr, kind, type, {frames, collected.series.columns}, collected.bytes.data(),
                MAT_F_DONT_COPY_DATA);
}

/// matio does not look whether its writes succeed. So each variable is written to memory as a file of its
/// own, and what stands behind that file's header is added to the real one, where every write is checked.
class MatFile {
 public:
  explicit MatFile(const std::filesystem::path& path)
      : name_(path.string()), out_(path), memory_(::memfd_create("tunnelrig-mat", MFD_CLOEXEC)) {
    if (memory_ < 0) fail_to_write(name_);
    memory_name_ = fmt::format("/proc/self/fd/{}", memory_);
  }
  ~MatFile() { ::close(memory_); }
  MatFile(const MatFile&) = delete;
  MatFile& operator=(const MatFile&) = delete;

  void add(matvar_t* variable) {
    mat_t* file = Mat_CreateVer(memory_name_.c_str(), "tunnelrig-export/1", MAT_FT_MAT5);
    if (file == nullptr) fail_to_write(name_);
    const int written = Mat_VarWrite(file, variable, MAT_COMPRESSION_NONE);
    if (Mat_Close(file) != 0 || written != 0) fail_to_write(name_);
    struct stat info {};
    if (::fstat(memory_, &info) != 0) fail_to_write(name_);
    append(static_cast<std::size_t>(info.st_size));
  }

  void close() { out_.close(); }

 private:
  void append(std::size_t size) {
    for (std::size_t at = empty_ ? 0 : kMatHeader; at < size;) {
      const ssize_t got = ::pread(memory_, buffer_.data(), buffer_.size(), static_cast<off_t>(at));
      if (got <= 0) fail_to_write(name_);
      out_.write(std::span(buffer_).first(static_cast<std::size_t>(got)));
      at += static_cast<std::size_t>(got);
    }
    empty_ = false;
  }

  std::string name_;
  OutputFile out_;
  int memory_;
  std::string memory_name_;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(kCopied);
  bool empty_ = true;
};

class MatWriter : public Writer {
 public:
  explicit MatWriter(const std::filesystem::path& path) : file_(path) {}

  void begin(const Recording& recording) override {
    recording_ = recording;
    done_ = 0;
    collected_.resize(recording.series.size());  // buffers are used again
    std::uint64_t bytes = 0;
    for (std::size_t s = 0; s < collected_.size(); ++s) {
      Series& series = collected_[s].series = recording.series[s];
      if (series.name == "frame") series.element = Element::kFloat64;  // as with integers of tables
      bytes += recording.frames * series.frame_size();
    }
    if (bytes > kLargestVariable - (1u << 20u)) {
      throw InputError(
          fmt::format("run {}: {:.1f} GB are more than a variable of a MATLAB level 5 file can hold (2 GB); "
                      "--format hdf5 "
                      "has no such limit, and MATLAB and Octave read it too",
                      recording.run, static_cast<double>(bytes) / 1e9));
    }
    for (Collected& one : collected_) one.bytes.resize(recording.frames * one.series.frame_size());
  }

  void block(const Block& block) override {
    for (std::size_t s = 0; s < collected_.size(); ++s)
      collect(block.series[s], recording_.series[s], collected_[s]);
    done_ += block.frames;
  }

  void end() override {
    std::vector<std::string> fields{"run", "location", "sample_rate_hz"}, names;
    for (const Collected& one : collected_) names.push_back(one.series.name);
    fields.insert(fields.end(), names.begin(), names.end());
    fields.emplace_back("units");
    Struct recording("raw_" + recording_.key, fields);
    recording.set("run", characters(nullptr, recording_.run));
    recording.set("location", characters(nullptr, recording_.location));
    recording.set("sample_rate_hz", numbers(nullptr, &recording_.sample_rate_hz, 1));
    Struct units("units", names);
    for (const Collected& one : collected_) {
      recording.set(one.series.name, value_of(one, recording_.frames));
      units.set(one.series.name, characters(nullptr, one.series.unit));
    }
    recording.set("units", units.take());
    file_.add(recording.get());
  }

  void table(const Table& table) override {
    std::vector<std::string> fields;
    for (const Column& column : table.columns) fields.push_back(column.name);
    Struct values(table.name, fields), units(table.name + "_units", fields);
    for (const Column& column : table.columns) {
      values.set(column.name, std::visit([](const auto& one) { return value_of(one); }, column.values));
      units.set(column.name, characters(nullptr, column.unit));
    }
    file_.add(values.get());
    file_.add(units.get());
  }

  void group(const ArrayGroup& group) override {
    std::vector<std::string> fields;
    for (const Array& array : group.arrays) fields.push_back(array.name);
    Struct values(group.name, fields), units(group.name + "_units", fields);
    for (const Array& array : group.arrays) {
      const std::size_t columns = array.columns(), rows = array.shape[0];
      Numbers by_column(array.values.size());
      for (std::size_t i = 0; i < rows; ++i)
        for (std::size_t j = 0; j < columns; ++j) by_column[j * rows + i] = array.values[i * columns + j];
      values.set(array.name, numbers(nullptr, by_column.data(), rows, columns));
      units.set(array.name, characters(nullptr, array.unit));
    }
    file_.add(values.get());
    file_.add(units.get());
  }

  void texts(const std::vector<Attachment>& texts) override {
    std::vector<std::string> fields;
    for (const Attachment& attachment : texts) fields.push_back(attachment.name);
    Struct all("texts", fields);
    for (const Attachment& attachment : texts) all.set(attachment.name, characters(nullptr, attachment.text));
    file_.add(all.get());
  }

  void finish(const std::vector<std::pair<std::string, std::string>>& provenance) override {
    std::vector<std::string> fields;
    for (const auto& [key, text] : provenance) fields.push_back(key);
    Struct all("provenance", fields);
    for (const auto& [key, text] : provenance) all.set(key, characters(nullptr, text));
    file_.add(all.get());
    file_.close();
  }

 private:
  template <typename From, typename To>
  void spread(std::span<const std::byte> frames, std::size_t columns, std::byte* to) const {
    const std::size_t count = frames.size() / (columns * sizeof(From));
    for (std::size_t c = 0; c < columns; ++c) {
      std::byte* column = to + (c * recording_.frames + done_) * sizeof(To);
      for (std::size_t f = 0; f < count; ++f) {
        From value;
        std::memcpy(&value, frames.data() + (f * columns + c) * sizeof(From), sizeof(From));
        const auto wide = static_cast<To>(value);
        std::memcpy(column + f * sizeof(To), &wide, sizeof(To));
      }
    }
  }

  /// Frames stand one after the other; a matrix has column after column.
  void collect(std::span<const std::byte> frames, const Series& from, Collected& to) const {
    const std::size_t columns = from.columns;
    std::byte* bytes = to.bytes.data();
    if (from.name == "frame")
      from.element == Element::kUInt32 ? spread<std::uint32_t, double>(frames, columns, bytes)
                                       : spread<std::uint64_t, double>(frames, columns, bytes);
    else if (size_of(from.element) == 2)
      spread<std::uint16_t, std::uint16_t>(frames, columns, bytes);
    else if (size_of(from.element) == 4)
      spread<std::uint32_t, std::uint32_t>(frames, columns, bytes);
    else
      spread<std::uint64_t, std::uint64_t>(frames, columns, bytes);
  }

  MatFile file_;
  Recording recording_;
  std::vector<Collected> collected_;
  std::uint64_t done_ = 0;  // frames of the recording
};

}  // namespace

std::unique_ptr<Writer> make_mat_writer(const std::filesystem::path& file) {
  return std::make_unique<MatWriter>(file);
}

}  // namespace tunnelrig::exports
