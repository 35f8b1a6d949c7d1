// NumPy's .npy files (format version 1.0), as far as raw runs use them.
#pragma once

#include "datasets/raw_data.h"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace tunnelrig {

/// A .npy file of shape (frames, channels), mapped into memory; `data` lives as long as this object.
class NpyFile {
 public:
  /// Throws InputError naming the file and the rule: not .npy, Fortran order, another type or shape,
  /// big-endian, fewer or more bytes than the shape says.
  explicit NpyFile(const std::filesystem::path& path);
  ~NpyFile();
  NpyFile(const NpyFile&) = delete;
  NpyFile& operator=(const NpyFile&) = delete;

  const RawFormat& format() const { return format_; }
  std::uint64_t frames() const { return frames_; }
  std::span<const std::byte> data() const { return data_; }

 private:
  void* map_ = nullptr;
  std::size_t map_size_ = 0;
  RawFormat format_;
  std::uint64_t frames_ = 0;
  std::span<const std::byte> data_;
};

/// The header of such a file, found at the start of `bytes`.
struct NpyHeader {
  RawFormat format;
  std::uint64_t frames = 0;
  std::size_t data_offset = 0;
};

/// Parses a header; `file` is for messages. Throws InputError as NpyFile does.
NpyHeader parse_npy_header(std::span<const std::byte> bytes, const std::string& file);

/// The bytes that stand before the samples in a file of this shape, a multiple of 64.
std::string format_npy_header(const RawFormat& format, std::uint64_t frames);

/// The same for any array in C order: `descr` is NumPy's, quotes included ("'<f8'", "[('run', '<U5')]").
/// Format version 2.0 where the header is too long for 1.0.
std::string format_npy_header(std::string_view descr, std::span<const std::uint64_t> shape);

}  // namespace tunnelrig
