// The rig's board on USB: found, opened, asked and told (docs/usb.md).
#pragma once

#include "daq/usb_bus.h"
#include "tunnelrig_usb.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {

/// A board as `tunnelrig devices` shows it. Where it cannot be opened, `problem` says why and the rest is
/// unknown.
struct UsbDevice {
  int bus = 0, address = 0;
  std::string serial, problem;
  bool no_permission = false;
  std::optional<trw_identity> identity;
  std::optional<trw_rate> rate;
  std::optional<trw_statistics> statistics;
};

/// Every board on the bus.
std::vector<UsbDevice> list_usb_boards();

/// An open board, its interface claimed.
class UsbBoard {
 public:
  /// The board whose serial number starts with `serial` (empty: the only one). Null where it cannot be had,
  /// and why.
  static std::unique_ptr<UsbBoard> open(const std::shared_ptr<UsbBus>& bus, const std::string& serial,
                                        std::string& why);

  const trw_identity& identity() const { return identity_; }
  const std::string& serial() const { return serial_; }
  const std::shared_ptr<UsbHandle>& handle() const { return handle_; }

  // Each is one control transfer with a bounded wait; false (or nothing) where the board refuses or does not
  // answer.
  bool start(bool pattern);
  bool stop();
  bool set_rate(const trw_rate_wish& wish);
  bool reboot_to_loader();
  std::optional<trw_rate> rate();
  std::optional<trw_statistics> statistics();

 private:
  UsbBoard(std::shared_ptr<UsbHandle> handle, std::string serial)
      : handle_(std::move(handle)), serial_(std::move(serial)) {}
  bool identify();
  bool command(std::uint8_t request, std::uint16_t value);
  friend std::vector<UsbDevice> list_usb_boards();

  std::shared_ptr<UsbHandle> handle_;
  std::string serial_;
  trw_identity identity_{};
};

}  // namespace tunnelrig
