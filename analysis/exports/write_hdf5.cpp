// HDF5: a group per table with a dataset per column, a group per recording, attributes for units
// (docs/exports.md).
#include "analysis/exports/unicode.h"
#include "analysis/exports/writer.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <hdf5.h>

namespace tunnelrig::exports {
namespace {

/// Closes an object of the library with it.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);

  Handle() = default;
  Handle(hid_t object, Close closing) : id_(object), close_(closing) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { close(); }

  herr_t close() {
    const hid_t id = std::exchange(id_, -1);
    return id < 0 ? 0 : close_(id);
  }
  hid_t id() const { return id_; }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

hid_t type_of(Element element) {
  const std::array<hid_t, 6> types = {H5T_STD_I16LE, H5T_STD_U16LE,  H5T_STD_U32LE,
                                      H5T_STD_U64LE, H5T_IEEE_F32LE, H5T_IEEE_F64LE};
  return types[static_cast<std::size_t>(element)];
}

/// UTF-8 cells of one length, the rest filled with zeros.
std::vector<char> padded(const Texts& texts, std::size_t size) {
  std::vector<char> cells(size * texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i) texts[i].copy(cells.data() + i * size, size);
  return cells;
}

class Hdf5Writer : public Writer {
 public:
  explicit Hdf5Writer(const std::filesystem::path& path) : name_(path.string()) {
    // Everything is closed here. At exit the library would once more close what a full disk kept it from
    // closing, and crash.
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // failures are said once, by us
    file_ = checked(H5Fcreate(name_.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    scalar_ = checked(H5Screate(H5S_SCALAR), H5Sclose);
    creation_ = checked(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    check(H5Pset_fill_time(creation_.id(), H5D_FILL_TIME_NEVER));
    text_type_ = checked(H5Tcopy(H5T_C_S1), H5Tclose);
    check(H5Tset_size(text_type_.id(), H5T_VARIABLE));
    check(H5Tset_cset(text_type_.id(), H5T_CSET_UTF8));
    raw_ = new_group(file_, "raw");
  }

  void begin(const Recording& recording) override {
    const Handle group = new_group(raw_, recording.key);
    text_attribute(group, "run", recording.run);
    text_attribute(group, "location", recording.location);
    const Handle rate = checked(
        H5Acreate2(group.id(), "sample_rate_hz", H5T_IEEE_F64LE, scalar_.id(), H5P_DEFAULT, H5P_DEFAULT),
        H5Aclose);
    check(H5Awrite(rate.id(), H5T_NATIVE_DOUBLE, &recording.sample_rate_hz));
    series_ = recording.series;
    done_ = 0;
    for (const Series& series : series_) {
      std::vector<std::size_t> shape{recording.frames};
      if (series.columns > 1) shape.push_back(series.columns);
      datasets_.push_back(new_dataset(group, series.name, series.unit, "", type_of(series.element), shape));
    }
  }

  void block(const Block& block) override {
    for (std::size_t s = 0; s < series_.size(); ++s) {
      const std::array<hsize_t, 2> start = {done_, 0}, count = {block.frames, series_[s].columns};
      const int rank = series_[s].columns > 1 ? 2 : 1;
      const Handle memory = checked(H5Screate_simple(rank, count.data(), nullptr), H5Sclose);
      const Handle space = checked(H5Dget_space(datasets_[s].id()), H5Sclose);
      check(H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr));
      check(H5Dwrite(datasets_[s].id(), type_of(series_[s].element), memory.id(), space.id(), H5P_DEFAULT,
                     block.series[s].data()));
    }
    done_ += block.frames;
  }

  void end() override {
    for (Handle& dataset : datasets_) check(dataset.close());
    datasets_.clear();
  }

  void table(const Table& table) override {
    const Handle group = new_group(file_, table.name);
    text_attribute(group, "meaning", table.meaning);
    for (const Column& column : table.columns)
      std::visit([&](const auto& values) { write_column(group, column, values); }, column.values);
  }

  void group(const ArrayGroup& arrays) override {
    const Handle group = new_group(file_, arrays.name);
    text_attribute(group, "meaning", arrays.meaning);
    for (const Array& array : arrays.arrays) {
      const Handle dataset =
          new_dataset(group, array.name, array.unit, array.meaning, H5T_IEEE_F64LE, array.shape);
      write_all(dataset, H5T_NATIVE_DOUBLE, array.values.data(), array.values.size());
    }
  }

  void texts(const std::vector<Attachment>& texts) override {
    const Handle group = new_group(file_, "texts");
    for (const Attachment& attachment : texts) {
      const Handle type = string_type(attachment.text.size(), is_ascii(attachment.text));
      const Handle dataset = checked(H5Dcreate2(group.id(), attachment.name.c_str(), type.id(), scalar_.id(),
                                                H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                                     H5Dclose);
      write_all(dataset, type.id(), attachment.text.c_str(), 1);
      text_attribute(dataset, "unit", "");
      text_attribute(dataset, "extension", attachment.extension);
    }
  }

  void finish(const std::vector<std::pair<std::string, std::string>>& provenance) override {
    for (const auto& [key, text] : provenance) text_attribute(file_, key.c_str(), text);
    raw_.close();
    check(H5Fflush(file_.id(), H5F_SCOPE_LOCAL));
    check(file_.close());
  }

 private:
  void check(herr_t status) const {
    if (status < 0) throw InputError::in(name_, "cannot be written; is the disk full?");
  }

  Handle checked(hid_t object, Handle::Close closing) const {
    check(object < 0 ? -1 : 0);
    return {object, closing};
  }

  Handle new_group(const Handle& where, const std::string& name) const {
    return checked(H5Gcreate2(where.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  }

  /// ASCII where it will do: HDF5 does not convert UTF-8 to it, which is all that Octave asks for.
  Handle string_type(std::size_t size, bool ascii) const {
    Handle type = checked(H5Tcopy(H5T_C_S1), H5Tclose);
    check(H5Tset_size(type.id(), std::max<std::size_t>(1, size)));
    check(H5Tset_strpad(type.id(), H5T_STR_NULLPAD));
    check(H5Tset_cset(type.id(), ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8));
    return type;
  }

  /// Of variable length, which h5py gives as str.
  void text_attribute(const Handle& where, const char* name, const std::string& text) const {
    const Handle attribute = checked(
        H5Acreate2(where.id(), name, text_type_.id(), scalar_.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const char* value = text.c_str();
    check(H5Awrite(attribute.id(), text_type_.id(), &value));
  }

  Handle new_dataset(const Handle& where, const std::string& name, const std::string& unit,
                     const std::string& meaning, hid_t type, const std::vector<std::size_t>& shape) const {
    const std::vector<hsize_t> extents(shape.begin(), shape.end());
    const Handle space =
        checked(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr), H5Sclose);
    Handle dataset = checked(
        H5Dcreate2(where.id(), name.c_str(), type, space.id(), H5P_DEFAULT, creation_.id(), H5P_DEFAULT),
        H5Dclose);
    text_attribute(dataset, "unit", unit);
    if (!meaning.empty()) text_attribute(dataset, "meaning", meaning);
    return dataset;
  }

  void write_all(const Handle& dataset, hid_t type, const void* data, std::size_t size) const {
    if (size > 0) check(H5Dwrite(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data));
  }

  void write_column(const Handle& group, const Column& column, const Numbers& values) const {
    const Handle to =
        new_dataset(group, column.name, column.unit, column.meaning, H5T_IEEE_F64LE, {values.size()});
    write_all(to, H5T_NATIVE_DOUBLE, values.data(), values.size());
  }
  void write_column(const Handle& group, const Column& column, const Integers& values) const {
    const Handle to =
        new_dataset(group, column.name, column.unit, column.meaning, H5T_STD_I64LE, {values.size()});
    write_all(to, H5T_NATIVE_INT64, values.data(), values.size());
  }
  void write_column(const Handle& group, const Column& column, const Flags& values) const {
    const Handle to =
        new_dataset(group, column.name, column.unit, column.meaning, H5T_STD_U8LE, {values.size()});
    write_all(to, H5T_NATIVE_UINT8, values.data(), values.size());
  }
  void write_column(const Handle& group, const Column& column, const Texts& values) const {
    std::size_t size = 1;
    for (const std::string& value : values) size = std::max(size, value.size());
    const Handle type = string_type(size, std::all_of(values.begin(), values.end(), is_ascii));
    const Handle to =
        new_dataset(group, column.name, column.unit, column.meaning, type.id(), {values.size()});
    write_all(to, type.id(), padded(values, size).data(), values.size());
  }

  std::string name_;
  Handle file_, scalar_, creation_, text_type_, raw_;
  std::vector<Series> series_;
  std::vector<Handle> datasets_;  // of the recording's series
  std::uint64_t done_ = 0;        // frames of it
};

}  // namespace

std::unique_ptr<Writer> make_hdf5_writer(const std::filesystem::path& file) {
  return std::make_unique<Hdf5Writer>(file);
}

}  // namespace tunnelrig::exports
