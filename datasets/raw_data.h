// What the channels read during one run, before any interpretation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// How one sample is stored. Integers are converter counts, floating point is volts.
enum class SampleType { kInt16, kUInt16, kFloat32, kFloat64 };

std::size_t sample_size(SampleType type);
bool is_counts(SampleType type);
std::string_view name_of(SampleType type);                // "int16", … as NumPy says it
SampleType sample_type_from_name(std::string_view name);  // throws InputError

/// The layout of a run's raw data: frames of `channels` samples, little-endian, one after the other.
struct RawFormat {
  SampleType type = SampleType::kInt16;
  int channels = 4;

  std::size_t frame_size() const { return sample_size(type) * static_cast<std::size_t>(channels); }
  bool operator==(const RawFormat&) const = default;
};

/// Frames that were sampled and never arrived.
struct Gap {
  std::uint64_t first_frame = 0;  // index, among the stored frames, of the first one after the gap
  std::uint64_t frames_lost = 0;
  std::string cause;       // "lost", "overrun", "reboot", …; empty where nobody recorded one
  bool estimated = false;  // the length comes from a clock, not from sequence numbers

  bool operator==(const Gap&) const = default;
};

/// Hash of a run's raw data, "xxh3:" and 32 hexadecimal digits over format, frames and gaps. It does not
/// depend on how the frames were cut into blobs.
class RawHasher {
 public:
  explicit RawHasher(const RawFormat& format);
  ~RawHasher();
  RawHasher(RawHasher&&) noexcept;
  RawHasher& operator=(RawHasher&&) noexcept;
  RawHasher(const RawHasher&) = delete;
  RawHasher& operator=(const RawHasher&) = delete;

  void add(std::span<const std::byte> frames);
  std::string finish(std::span<const Gap> gaps);

 private:
  void* state_;
};

/// CRC-32C as in the wire format, by the processor's instruction where it has one.
std::uint32_t crc32c(std::span<const std::byte> data);

}  // namespace tunnelrig
