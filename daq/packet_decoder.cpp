#include "daq/packet_decoder.h"

#include "datasets/raw_data.h"

#include <cstring>

namespace tunnelrig {
namespace {

constexpr int kFirstSyncByte = 0x54;

/// As trw_parse, with the checksum by the processor's instruction.
trw_result parse(std::span<const std::byte> bytes, trw_header& header) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const trw_result found = trw_parse_header(data, bytes.size(), &header);
  if (found != TRW_OK) return found;
  const std::size_t whole = trw_packet_size(header.frame_count);
  if (bytes.size() < whole) return TRW_NEED_MORE;
  const std::size_t body = whole - TRW_CRC_SIZE;
  return trw_get32(data + body) == crc32c(bytes.first(body)) ? TRW_OK : TRW_BAD_CRC;
}

/// Bytes up to the next one that a packet could start with; at least one.
std::size_t distance_to_sync(std::span<const std::byte> bytes) {
  const void* found =
      bytes.size() > 1 ? std::memchr(bytes.data() + 1, kFirstSyncByte, bytes.size() - 1) : nullptr;
  if (found == nullptr) return bytes.size();
  return static_cast<std::size_t>(static_cast<const std::byte*>(found) - bytes.data());
}

}  // namespace

std::size_t PacketDecoder::consume(std::span<const std::byte> bytes, PacketSink& sink) {
  std::size_t at = 0;
  while (at < bytes.size()) {
    const auto rest = bytes.subspan(at);
    Packet packet;
    const trw_result found = parse(rest, packet.header);
    if (found == TRW_NEED_MORE) break;
    if (found == TRW_OK) {
      const std::size_t whole = trw_packet_size(packet.header.frame_count);
      packet.frames = rest.subspan(TRW_HEADER_SIZE, whole - TRW_HEADER_SIZE - TRW_CRC_SIZE);
      ++packets_;
      sink.packet(packet);
      at += whole;
      continue;
    }
    if (found == TRW_BAD_CRC) ++corrupt_;
    const std::size_t skipped = distance_to_sync(rest);
    bytes_skipped_ += skipped;
    at += skipped;
  }
  return at;
}

void PacketDecoder::push(std::span<const std::byte> bytes, PacketSink& sink) {
  if (!held_.empty()) {
    held_.insert(held_.end(), bytes.begin(), bytes.end());
    bytes = held_;
  }
  const std::size_t used = consume(bytes, sink);
  const auto rest = bytes.subspan(used);
  held_ = std::vector<std::byte>(rest.begin(), rest.end());
}

void PacketDecoder::finish(PacketSink& sink) {
  std::vector<std::byte> left;
  left.swap(held_);
  std::span<const std::byte> bytes = left;
  while (!bytes.empty()) {
    // What starts here is cut off by the end; a whole packet may still stand behind it.
    const std::size_t skipped = distance_to_sync(bytes);
    bytes_skipped_ += skipped;
    bytes = bytes.subspan(skipped);
    bytes = bytes.subspan(consume(bytes, sink));
  }
}

}  // namespace tunnelrig
