// A USB device controller in software, and the host's side of its bus: what runs below the firmware's core in
// every test without a board. Simulated; it shares no code with board/otg_fs.c.
#pragma once

#include "usb_device.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tunnelrig::simulated {

/// Answers of a bus transaction, as Linux numbers them.
enum BusStatus { kNak = -11, kStall = -32, kBabble = -75, kHang = -110 };

class Controller {
 public:
  /// Works for `device` until either ends.
  explicit Controller(usb_device& device) : device_(device) {}

  static const usb_controller& table();

  /// A whole control transfer, as a host makes it. `data` is the OUT stage, or takes the IN stage (wLength
  /// bytes). Returns the bytes moved, kStall, or kHang where the device would answer NAK for ever.
  int control(const std::uint8_t setup[8], std::uint8_t* data);

  /// Only the setup stage, for a host that changes its mind.
  void setup_only(const std::uint8_t setup[8]);

  /// One IN packet of the stream endpoint: its size, kNak, kStall, or kBabble where `room` is too small for
  /// it.
  int in_packet(std::uint8_t* out, std::size_t room);

  void reset();

  std::uint8_t address() const { return address_; }
  bool stream_open() const { return stream_.open; }

 private:
  struct Endpoint {
    const std::uint8_t* data = nullptr;
    std::size_t size = 0, sent = 0;
    bool armed = false, open = false, stalled = false;
  };

  int control_in(std::uint16_t wanted, std::uint8_t* data);
  int control_out(std::uint16_t size, const std::uint8_t* data);
  static int take_packet(Endpoint& endpoint, std::uint8_t* out, std::size_t room);
  Endpoint& in_endpoint(std::uint8_t address) { return address == TRW_USB_STREAM_IN ? stream_ : control_in_; }

  static void on_set_address(void* context, std::uint8_t address);
  static void on_open(void* context, std::uint8_t endpoint, std::uint16_t size);
  static void on_close(void* context, std::uint8_t endpoint);
  static void on_send(void* context, std::uint8_t endpoint, const std::uint8_t* data, std::uint16_t size);
  static void on_receive(void* context, std::uint8_t* data, std::uint16_t size);
  static void on_stall(void* context, std::uint8_t endpoint);
  static void on_clear_stall(void* context, std::uint8_t endpoint);

  usb_device& device_;
  Endpoint control_in_, stream_;
  std::uint8_t* out_data_ = nullptr;
  std::size_t out_size_ = 0;
  bool out_armed_ = false, control_stalled_ = false;
  std::uint8_t address_ = 0;
};

}  // namespace tunnelrig::simulated
