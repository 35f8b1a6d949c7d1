// The firmware's core on the host: simulated converter and clock above a simulated controller. Simulated, and
// says so in its identity. Used by one thread at a time.
#pragma once

#include "rig_board.h"
#include "simulated/controller.h"

#include <array>
#include <cstdint>
#include <functional>

namespace tunnelrig::simulated {

/// The sample of channel `c` in frame `sequence`: every frame is recognisable.
std::int16_t sample_of(std::uint64_t sequence, std::size_t c);

class Board {
 public:
  explicit Board(std::uint32_t boot_id = 1, std::uint8_t serial = 0x5A);
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  /// Power off and on: everything starts anew, under another boot id.
  void power_cycle();

  /// Another board in its place, with its cells; off and on, as power_cycle.
  void replace(std::uint8_t serial);

  /// The time of `frames` frames passes: where sampling runs, they are sampled.
  void advance(std::uint64_t frames);

  /// The same, but only as long as the ring has room: a source that is never too fast.
  void fill();

  void poll() { board_poll(&core); }

  bool running() const { return core.running; }
  std::uint64_t frames_sampled() const { return core.sequence; }
  double frame_rate_hz() const;

  /// Converts a request as a host would give it. See Controller::control.
  int control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
              std::uint16_t length, std::uint8_t* data);

  /// What a kernel does to a device that appears: reset, address, configuration 1.
  void enumerate();

  rig_board core{};
  Controller controller{core.usb};
  bool loader_asked = false;
  std::uint32_t starts = 0;
  std::uint32_t ticks_per_scan = 0, scans_per_frame = 1;
  bool amplifier_fitted = false;

 private:
  void power_up();
  static const board_port& port();

  std::uint32_t boot_id_;
  std::uint8_t serial_;
  std::uint64_t ticks_ = 0;
};

}  // namespace tunnelrig::simulated
