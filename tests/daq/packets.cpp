#include "daq/packets.h"

#include <cstring>

namespace tunnelrig::test {

std::int16_t sample_of(std::uint64_t sequence, std::size_t channel) {
  return static_cast<std::int16_t>((sequence * 7 + channel * 1000) % 4096);
}

std::vector<std::byte> packet_bytes(const PacketSpec& spec) {
  const trw_header header{.boot_id = spec.boot,
                          .tick_hz = 84000000,
                          .first_sequence = spec.first,
                          .first_ticks = spec.first * spec.ticks_per_frame,
                          .ticks_per_frame = spec.ticks_per_frame,
                          .overruns = 0,
                          .frame_count = spec.count};
  std::vector<trw_frame> frames(spec.count);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) frames[i].sample[c] = sample_of(spec.sampled + spec.first + i, c);
    frames[i].status = i == 0 ? spec.first_status : std::uint16_t{0};
  }
  std::vector<std::byte> bytes(trw_packet_size(spec.count));
  trw_encode(reinterpret_cast<std::uint8_t*>(bytes.data()), &header, frames.data());
  return bytes;
}

void FrameList::frames(std::span<const std::byte> data) {
  const std::size_t old = samples.size();
  samples.resize(old + data.size() / 2);
  std::memcpy(samples.data() + old, data.data(), data.size());
}

}  // namespace tunnelrig::test
