#include "datasets/npy.h"

#include "datasets/error.h"

#include <array>
#include <cerrno>
#include <charconv>
#include <limits>
#include <system_error>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";

struct Descr {
  std::string_view descr;
  SampleType type;
};
constexpr std::array<Descr, 4> kDescrs = {{{"<i2", SampleType::kInt16},
                                           {"<u2", SampleType::kUInt16},
                                           {"<f4", SampleType::kFloat32},
                                           {"<f8", SampleType::kFloat64}}};

/// The text after "'key':" in the header's Python dictionary, blanks skipped.
std::string_view value_of(std::string_view dict, std::string_view key, const std::string& file) {
  const auto at = dict.find(fmt::format("'{}':", key));
  if (at == std::string_view::npos) throw InputError::in(file, "the .npy header has no '{}'", key);
  dict.remove_prefix(at + key.size() + 3);
  dict.remove_prefix(std::min(dict.find_first_not_of(' '), dict.size()));
  return dict;
}

SampleType parse_type(std::string_view value, const std::string& file) {
  for (const Descr& known : kDescrs) {
    if (value.starts_with(fmt::format("'{}'", known.descr))) return known.type;
  }
  throw InputError::in(file,
                       "samples are {}; int16 or uint16 (counts) or float32 or float64 (volts), "
                       "little-endian, are required",
                       value.substr(0, value.find_first_of(",}")));
}

std::vector<std::uint64_t> parse_shape(std::string_view value, const std::string& file) {
  std::vector<std::uint64_t> shape;
  if (!value.starts_with('(')) throw InputError::in(file, "the .npy header's shape is no tuple");
  value.remove_prefix(1);
  while (!value.empty() && value.front() != ')') {
    std::uint64_t extent = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), extent);
    if (error != std::errc()) throw InputError::in(file, "the .npy header's shape is no tuple of numbers");
    shape.push_back(extent);
    value.remove_prefix(static_cast<std::size_t>(end - value.data()));
    value.remove_prefix(std::min(value.find_first_not_of(", "), value.size()));
  }
  return shape;
}

}  // namespace

NpyHeader parse_npy_header(std::span<const std::byte> bytes, const std::string& file) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with(kMagic) || text.size() < 10) throw InputError::in(file, "is not a .npy file");
  if (text[6] != 1) {
    throw InputError::in(file, ".npy format version {}.{}; version 1.0 is required",
                         static_cast<int>(text[6]), static_cast<int>(text[7]));
  }
  const std::size_t length =
      static_cast<std::uint8_t>(text[8]) + std::size_t{256} * static_cast<std::uint8_t>(text[9]);
  if (text.size() < 10 + length) throw InputError::in(file, "ends within its .npy header");
  const std::string_view dict = text.substr(10, length);
  if (!value_of(dict, "fortran_order", file).starts_with("False")) {
    throw InputError::in(file, "is in Fortran order; C order (frame after frame) is required");
  }
  NpyHeader header;
  header.data_offset = 10 + length;
  header.format.type = parse_type(value_of(dict, "descr", file), file);
  const auto shape = parse_shape(value_of(dict, "shape", file), file);
  if (shape.size() != 2 || shape[1] < 1 || shape[1] > 4) {
    throw InputError::in(file, "has shape ({}); (frames, 4) is required", fmt::join(shape, ", "));
  }
  if (shape[0] > std::numeric_limits<std::uint32_t>::max()) {
    throw InputError::in(file, "claims {} frames; at most 2^32 - 1 are allowed", shape[0]);
  }
  header.frames = shape[0];
  header.format.channels = static_cast<int>(shape[1]);
  return header;
}

NpyFile::NpyFile(const std::filesystem::path& path) {
  const std::string file = path.string();
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat info {};
  if (fd < 0 || ::fstat(fd, &info) != 0) {
    const std::string reason = std::generic_category().message(errno);
    if (fd >= 0) ::close(fd);
    throw InputError::in(file, "cannot be read: {}", reason);
  }
  map_size_ = static_cast<std::size_t>(info.st_size);
  void* map = S_ISREG(info.st_mode) && map_size_ > 0
                  ? ::mmap(nullptr, map_size_, PROT_READ, MAP_PRIVATE | MAP_POPULATE, fd, 0)
                  : MAP_FAILED;
  ::close(fd);
  if (map == MAP_FAILED) throw InputError::in(file, "is not a .npy file");
  map_ = map;
  try {
    const std::span<const std::byte> bytes(static_cast<const std::byte*>(map_), map_size_);
    const NpyHeader header = parse_npy_header(bytes, file);
    const std::size_t wanted = header.frames * header.format.frame_size();
    if (bytes.size() - header.data_offset != wanted) {
      throw InputError::in(file, "holds {} bytes of samples where its shape ({}, {}) needs {}",
                           bytes.size() - header.data_offset, header.frames, header.format.channels, wanted);
    }
    format_ = header.format;
    frames_ = header.frames;
    data_ = bytes.subspan(header.data_offset);
  } catch (...) {
    ::munmap(map_, map_size_);
    throw;
  }
}

NpyFile::~NpyFile() { ::munmap(map_, map_size_); }

std::string format_npy_header(const RawFormat& format, std::uint64_t frames) {
  const std::array<std::uint64_t, 2> shape = {frames, static_cast<std::uint64_t>(format.channels)};
  const std::string_view descr = kDescrs[static_cast<std::size_t>(format.type)].descr;
  return format_npy_header(fmt::format("'{}'", descr), shape);
}

std::string format_npy_header(std::string_view descr, std::span<const std::uint64_t> shape) {
  std::string dict = fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': ({}{}), }}", descr,
                                 fmt::join(shape, ", "), shape.size() == 1 ? "," : "");
  constexpr std::size_t kLongest = 0xFFFF - 64;
  const bool long_length = dict.size() > kLongest;  // as four bytes, not two
  const std::size_t unpadded = kMagic.size() + (long_length ? 6 : 4) + dict.size() + 1;
  dict.append((64 - unpadded % 64) % 64, ' ');
  dict.push_back('\n');
  std::string out(kMagic);
  out.push_back(long_length ? '\x02' : '\x01');
  out.push_back('\0');
  for (std::size_t byte = 0; byte < (long_length ? 4u : 2u); ++byte)
    out.push_back(static_cast<char>((dict.size() >> (8 * byte)) & 0xFFu));
  return out + dict;
}

}  // namespace tunnelrig
