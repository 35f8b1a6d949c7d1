#include "datasets/raw_data.h"

#include "datasets/error.h"
#include "tunnelrig_wire.h"

#include <array>
#include <bit>
#include <cstring>
#include <utility>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace tunnelrig {

static_assert(std::endian::native == std::endian::little, "raw frames are stored as they lie in memory");

namespace {

struct TypeEntry {
  SampleType type;
  std::string_view name;
  std::size_t size;
};

constexpr std::array<TypeEntry, 4> kTypes = {{{SampleType::kInt16, "int16", 2},
                                              {SampleType::kUInt16, "uint16", 2},
                                              {SampleType::kFloat32, "float32", 4},
                                              {SampleType::kFloat64, "float64", 8}}};

const TypeEntry& entry(SampleType type) { return kTypes[static_cast<std::size_t>(type)]; }

XXH3_state_t* state_of(void* state) { return static_cast<XXH3_state_t*>(state); }

}  // namespace

std::size_t sample_size(SampleType type) { return entry(type).size; }
std::string_view name_of(SampleType type) { return entry(type).name; }
bool is_counts(SampleType type) { return type == SampleType::kInt16 || type == SampleType::kUInt16; }

SampleType sample_type_from_name(std::string_view name) {
  for (const TypeEntry& known : kTypes) {
    if (known.name == name) return known.type;
  }
  throw InputError(fmt::format("'{}' is not a sample type (int16, uint16, float32, float64)", name));
}

RawHasher::RawHasher(const RawFormat& format) : state_(XXH3_createState()) {
  XXH3_128bits_reset(state_of(state_));
  const std::string head = fmt::format("{}x{};", name_of(format.type), format.channels);
  XXH3_128bits_update(state_of(state_), head.data(), head.size());
}

RawHasher::~RawHasher() { XXH3_freeState(state_of(state_)); }

RawHasher::RawHasher(RawHasher&& other) noexcept : state_(std::exchange(other.state_, nullptr)) {}

RawHasher& RawHasher::operator=(RawHasher&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}

void RawHasher::add(std::span<const std::byte> frames) {
  XXH3_128bits_update(state_of(state_), frames.data(), frames.size());
}

std::string RawHasher::finish(std::span<const Gap> gaps) {
  for (const Gap& gap : gaps) {
    const std::string text = fmt::format(";{}+{}", gap.first_frame, gap.frames_lost);
    XXH3_128bits_update(state_of(state_), text.data(), text.size());
  }
  const XXH128_hash_t hash = XXH3_128bits_digest(state_of(state_));
  return fmt::format("xxh3:{:016x}{:016x}", hash.high64, hash.low64);
}

namespace {

std::uint32_t crc32c_portable(std::span<const std::byte> data) {
  return trw_crc32c(0, reinterpret_cast<const std::uint8_t*>(data.data()), data.size());
}

#if defined(__x86_64__)
__attribute__((target("sse4.2"))) std::uint32_t crc32c_sse42(std::span<const std::byte> data) {
  std::uint64_t crc = 0xFFFFFFFFu;
  const std::byte* at = data.data();
  std::size_t left = data.size();
  for (; left >= 8; at += 8, left -= 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, at, 8);
    crc = __builtin_ia32_crc32di(crc, word);
  }
  auto tail = static_cast<std::uint32_t>(crc);
  for (; left > 0; ++at, --left) tail = __builtin_ia32_crc32qi(tail, static_cast<unsigned char>(*at));
  return ~tail;
}
#endif

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> data) {
#if defined(__x86_64__)
  static const bool has_instruction = __builtin_cpu_supports("sse4.2") != 0;
  if (has_instruction) return crc32c_sse42(data);
#endif
  return crc32c_portable(data);
}

}  // namespace tunnelrig
