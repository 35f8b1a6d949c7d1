// Any sequence of setup packets, stream reads, samples, resets and halts: the device answers or stalls, never
// hangs, and what it streams decodes without a frame lost or invented.
#include "daq/loss_ledger.h"
#include "daq/packet_decoder.h"
#include "simulated/board.h"

#include <cstdlib>
#include <memory>

namespace {

using namespace tunnelrig;

class Track : public PacketSink, public FrameSink {
 public:
  void packet(const Packet& packet) override { tracker.take(packet, 0, *this); }
  void frames(std::span<const std::byte>) override {}
  void gap(const Gap& gap) override {
    if (gap.cause != "overrun") others += gap.frames_lost;
  }
  PacketDecoder decoder;
  LossTracker tracker{0};
  std::uint64_t others = 0;
};

struct Input {
  const std::uint8_t* data;
  std::size_t size;
  std::uint8_t next() { return size == 0 ? std::uint8_t{0} : (--size, *data++); }
};

std::uint8_t scratch[65536];
bool stopped_once;

void control(simulated::Board& board, Input& input) {
  std::uint8_t setup[8];
  for (std::uint8_t& byte : setup) byte = input.next();
  if (setup[0] == 0x40 && setup[1] == TRW_USB_STOP) stopped_once = true;  // a stop drops frames on purpose
  const bool finish = (input.next() & 1u) != 0;
  if (!finish) {
    board.controller.setup_only(setup);
    if ((setup[0] & 0xE0u) == 0x40 && setup[1] == TRW_USB_LOADER) stopped_once = true;
    return;
  }
  for (std::size_t i = 0; i < 64; ++i) scratch[i] = input.next();
  if ((setup[0] & 0xE0u) == 0x40) stopped_once |= setup[1] == TRW_USB_LOADER || setup[1] == TRW_USB_STOP;
  const int result = board.controller.control(setup, scratch);
  if (result < 0 && result != simulated::kStall) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static simulated::Board board;
  board.power_cycle();
  Track track;
  Input input{data, size};
  stopped_once = false;
  std::uint8_t packet[64];
  for (int step = 0; input.size > 0 && step < 2000; ++step) {
    switch (input.next() % 8) {
      case 0:
      case 1:
        control(board, input);
        break;
      case 2:
        board.advance(input.next() * 8u);
        break;
      case 3:
      case 4:
        for (int i = input.next(); i > 0; --i) {
          board.poll();
          const int got = board.controller.in_packet(packet, sizeof packet);
          if (got > 0)
            track.decoder.push(std::as_bytes(std::span(packet, static_cast<std::size_t>(got))), track);
        }
        break;
      case 5:
        board.enumerate();
        break;
      case 6:
        board.control(0x40, TRW_USB_START, input.next() & 1u, 0, 0, nullptr);
        break;
      default:
        if (input.next() % 4 == 0) board.controller.reset();
    }
  }
  if (!track.tracker.ledger().closed()) std::abort();
  if (!stopped_once && track.others > 0) std::abort();
  return 0;
}
