// Any bytes, cut into any pieces: the decoder and the loss tracker never throw, never grow, and every frame
// is accounted for.
#include "daq/loss_ledger.h"
#include "daq/packet_decoder.h"
#include "fuzz/input.h"

#include <cstdlib>

namespace {

using namespace tunnelrig;

class Count : public FrameSink {
 public:
  void frames(std::span<const std::byte> data) override { stored += data.size() / 8; }
  void gap(const Gap& gap) override { lost += gap.frames_lost; }
  std::uint64_t stored = 0, lost = 0;
};

class Track : public PacketSink {
 public:
  explicit Track(std::uint64_t wanted) : tracker(wanted) {}
  void packet(const Packet& packet) override { tracker.take(packet, time_s += 0.01, count); }
  LossTracker tracker;
  Count count;
  double time_s = 0;
};

/// Makes valid packets of the input, so that the tracker meets more than the decoder lets through of random
/// bytes.
void push_as_packets(std::span<const std::byte> input, PacketDecoder& decoder, Track& track) {
  constexpr std::size_t kBytes = 12;
  for (; input.size() >= kBytes; input = input.subspan(kBytes)) {
    const auto* in = reinterpret_cast<const std::uint8_t*>(input.data());
    trw_header header{};
    header.boot_id = in[0] & 3u;
    header.first_sequence = (in[1] & 1u) != 0 ? trw_get64(in + 4) : trw_get16(in + 4);
    header.tick_hz = trw_get16(in + 2);
    header.ticks_per_frame = in[1];
    header.frame_count = static_cast<std::uint8_t>(1 + in[0] % 64);
    trw_frame frames[64] = {};
    std::uint8_t packet[TRW_MAX_PACKET];
    const std::size_t size = trw_encode(packet, &header, frames);
    decoder.push(std::as_bytes(std::span(packet, size)), track);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const auto input = fuzz::as_bytes(data + 2, size - 2);
  Track track(data[0]);
  PacketDecoder decoder;
  if ((data[1] & 1u) != 0) {
    push_as_packets(input, decoder, track);
  } else {
    const std::size_t piece = 1 + data[1];
    for (std::size_t at = 0; at < input.size(); at += piece)
      decoder.push(input.subspan(at, std::min(piece, input.size() - at)), track);
  }
  decoder.finish(track);
  const Ledger& ledger = track.tracker.ledger();
  if (!ledger.closed() || ledger.frames_stored != track.count.stored ||
      ledger.frames_lost != track.count.lost)
    std::abort();
  if (data[0] != 0 && ledger.frames_emitted > data[0]) std::abort();
  return 0;
}
