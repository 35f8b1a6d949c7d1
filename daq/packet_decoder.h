// Bytes to packets: finds whole, valid packets in any byte stream and counts the rest.
#pragma once

#include "tunnelrig_wire.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tunnelrig {

/// A valid packet; `frames` are header.frame_count records of the wire format and live until the next push.
struct Packet {
  trw_header header{};
  std::span<const std::byte> frames;
};

class PacketSink {
 public:
  virtual ~PacketSink() = default;
  virtual void packet(const Packet& packet) = 0;
};

/// Takes bytes in pieces of any size and passes on every valid packet in them. No input makes it throw or
/// grow: it holds at most one packet's worth of bytes between pushes.
class PacketDecoder {
 public:
  void push(std::span<const std::byte> bytes, PacketSink& sink);

  /// The stream has ended: what is held back as a possible beginning is searched to its last byte.
  void finish(PacketSink& sink);

  std::uint64_t packets() const { return packets_; }
  std::uint64_t corrupt() const { return corrupt_; }              // whole packets with a wrong checksum
  std::uint64_t bytes_skipped() const { return bytes_skipped_; }  // outside of valid packets

 private:
  std::size_t consume(std::span<const std::byte> bytes, PacketSink& sink);

  std::vector<std::byte> held_;
  std::uint64_t packets_ = 0;
  std::uint64_t corrupt_ = 0;
  std::uint64_t bytes_skipped_ = 0;
};

}  // namespace tunnelrig
