#pragma once

#include "daq/packet_decoder.h"
#include "datasets/raw_store.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tunnelrig::test {

/// The sample of channel `c` in frame `sequence`: every frame is recognisable.
std::int16_t sample_of(std::uint64_t sequence, std::size_t channel);

struct PacketSpec {
  std::uint64_t first = 0;
  std::uint8_t count = 16;
  std::uint32_t boot = 1;
  std::uint16_t first_status = 0;
  std::uint32_t ticks_per_frame = 84000;  // of 84 MHz
  std::uint64_t sampled = 0;              // frames that were sampled before a restart: the samples go on
};

/// The bytes of a packet of recognisable frames, at 1000 frames/s unless said otherwise.
std::vector<std::byte> packet_bytes(const PacketSpec& spec);

/// Keeps what a decoder finds.
class PacketList : public PacketSink {
 public:
  struct Seen {
    trw_header header;
    std::vector<std::byte> frames;
  };
  void packet(const Packet& packet) override {
    seen.push_back({packet.header, {packet.frames.begin(), packet.frames.end()}});
  }
  std::vector<Seen> seen;
};

/// Keeps what a tracker passes on.
class FrameList : public FrameSink {
 public:
  void frames(std::span<const std::byte> data) override;
  void gap(const Gap& gap) override { gaps.push_back(gap); }

  std::vector<std::int16_t> samples;  // four per frame
  std::vector<Gap> gaps;
  std::size_t count() const { return samples.size() / 4; }
};

}  // namespace tunnelrig::test
