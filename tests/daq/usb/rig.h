// The real libusb logger against the firmware's core, on a bus simulated by umockdev.
#pragma once

#include "daq/logging.h"
#include "daq/packet_source.h"
#include "daq/packets.h"
#include "daq/usb_source.h"
#include "simulated/usb_bus.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <vector>

namespace tunnelrig::test {

/// A board on a bus, plugged in.
struct Rig {
  explicit Rig(simulated::Pace pace) : bus(board, pace) { bus.plug(); }
  simulated::Board board;
  simulated::UsbBus bus;
};

struct Logged {
  LogOutcome outcome;
  std::vector<std::int16_t> samples;
  std::vector<Gap> gaps;
};

/// A run as it is recorded and read back.
Logged log_usb(PacketSource& source, double duration_s,
               const std::function<void(const LogProgress&)>& progress = {},
               const std::atomic<bool>& stop = never_stop());

/// Each stored frame is the one whose place it takes; behind an estimated gap the place is learnt anew.
void expect_every_frame_in_its_place(const Logged& logged);

UsbSourceSettings small_transfers();

double since(std::chrono::steady_clock::time_point start);

}  // namespace tunnelrig::test
