#include "simulated/board.h"

#include <cstring>

namespace tunnelrig::simulated {
namespace {

constexpr std::uint32_t kTick_hz = 84000000;
constexpr std::uint32_t kHighestRate_hz = 10000;
constexpr std::uint32_t kScan_ticks = 1548;  // the F405's 18.4 us

Board& self(void* context) { return *static_cast<Board*>(context); }

}  // namespace

std::int16_t sample_of(std::uint64_t sequence, std::size_t c) {
  return static_cast<std::int16_t>((sequence * 7 + c * 1000) % 4096);
}

const board_port& Board::port() {
  static const board_port functions = {
      .start_sampling =
          [](void* context, std::uint32_t ticks, std::uint32_t scans) {
            ++self(context).starts;
            self(context).ticks_per_scan = ticks;
            self(context).scans_per_frame = scans;
          },
      .stop_sampling = [](void*) {},
      .ticks = [](void* context) { return self(context).ticks_; },
      .lock = [](void*) -> std::uint32_t { return 0; },
      .unlock = [](void*, std::uint32_t) {},
      .set_amplifier = [](void*, std::uint8_t, trw_amplifier wish) { return wish.gain <= 255; },
      .reboot_to_loader = [](void* context) { self(context).loader_asked = true; },
  };
  return functions;
}

Board::Board(std::uint32_t boot_id, std::uint8_t serial) : boot_id_(boot_id), serial_(serial) { power_up(); }

void Board::power_up() {
  trw_identity identity{};
  identity.firmware = 0x0100;
  identity.boot_id = boot_id_;
  for (std::size_t i = 0; i < sizeof identity.unique_id; ++i) {
    identity.unique_id[i] = static_cast<std::uint8_t>(serial_ + i);
  }
  identity.tick_hz = kTick_hz;
  identity.amplifier_mask = amplifier_fitted ? 0x0F : 0;
  identity.variant = TRW_VARIANT_SIMULATED;
  std::strcpy(identity.describe, "simulated");
  board_init(&core, &port(), this, &Controller::table(), &controller, &identity, kHighestRate_hz,
             kScan_ticks);
  controller.reset();
}

void Board::power_cycle() {
  ++boot_id_;
  ticks_ = 0;
  power_up();
}

void Board::replace(std::uint8_t serial) {
  serial_ = serial;
  power_cycle();
}

double Board::frame_rate_hz() const {
  return static_cast<double>(core.rate.tick_hz) / core.rate.ticks_per_frame;
}

void Board::advance(std::uint64_t frames) {
  for (; frames > 0; --frames) {
    ticks_ += core.rate.ticks_per_frame;
    if (!core.running) continue;
    std::array<std::uint16_t, std::size_t{DECIMATION} * TRW_CHANNELS> scans;
    for (std::size_t i = 0; i < scans_per_frame * TRW_CHANNELS; ++i) {
      scans[i] = static_cast<std::uint16_t>(sample_of(core.sequence, i % TRW_CHANNELS));
    }
    board_on_scans(&core, scans.data());
  }
}

void Board::fill() {
  const std::uint32_t room = BOARD_RING_FRAMES - ring_count(&core.ring);
  if (core.running && room > 0) advance(room);
}

int Board::control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
                   std::uint16_t length, std::uint8_t* data) {
  const auto low = [](std::uint16_t v) { return static_cast<std::uint8_t>(v); };
  const auto high = [](std::uint16_t v) { return static_cast<std::uint8_t>(v >> 8); };
  const std::uint8_t setup[8] = {type,       request,     low(value),  high(value),
                                 low(index), high(index), low(length), high(length)};
  return controller.control(setup, data);
}

void Board::enumerate() {
  controller.reset();
  control(0x00, 5, 7, 0, 0, nullptr);
  control(0x00, 9, 1, 0, 0, nullptr);
}

}  // namespace tunnelrig::simulated
