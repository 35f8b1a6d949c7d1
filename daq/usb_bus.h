// libusb with its own event thread, and calls that come back: no wait here or above is longer than it says.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

struct libusb_context;
struct libusb_device;
struct libusb_device_handle;

namespace tunnelrig {

/// One libusb context. Its thread handles events until the object ends.
class UsbBus {
 public:
  UsbBus();  // throws InputError where libusb cannot start
  ~UsbBus();
  UsbBus(const UsbBus&) = delete;
  UsbBus& operator=(const UsbBus&) = delete;

  libusb_context* context() const { return context_; }

  /// Something of ours is still pending in the context and will never be given back: it must outlive us.
  void abandon() { abandoned_ = true; }

  /// An open device that calls of ours are still inside of.
  struct Left {
    libusb_device_handle* handle;
    int claimed;
    std::shared_ptr<const std::atomic<int>> calls_inside;
  };
  /// Takes it over: it is closed when they are back, or nobody else could open the device any more.
  void leave(Left left);

 private:
  void close_left();

  libusb_context* context_ = nullptr;
  std::atomic<bool> stop_{false}, abandoned_{false};
  std::mutex left_mutex_;
  std::vector<Left> left_;
  std::thread events_;
};

/// An open device. Ends with everything given back, or, where the bus gives nothing back, with it left to the
/// bus on purpose: a transfer that is pending is never freed.
class UsbHandle {
 public:
  /// libusb's error where it cannot be opened.
  static std::shared_ptr<UsbHandle> open(std::shared_ptr<UsbBus> bus, libusb_device* device, int& error);
  ~UsbHandle();
  UsbHandle(const UsbHandle&) = delete;
  UsbHandle& operator=(const UsbHandle&) = delete;

  libusb_device_handle* get() const { return handle_; }
  UsbBus& bus() const { return *bus_; }

  int claim(int interface);

  /// A control transfer; bytes moved, or libusb's error. Back within `timeout` + 100 ms whatever the device
  /// does.
  int control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
              std::span<std::uint8_t> data,
              std::chrono::milliseconds timeout = std::chrono::milliseconds(200));

  /// CLEAR_FEATURE(ENDPOINT_HALT) by the system, which may take its time: false where it took more than 300
  /// ms.
  bool clear_halt(std::uint8_t endpoint);

 private:
  UsbHandle(std::shared_ptr<UsbBus> bus, libusb_device_handle* handle)
      : bus_(std::move(bus)), handle_(handle) {}

  std::shared_ptr<UsbBus> bus_;
  libusb_device_handle* handle_;
  int claimed_ = -1;
  std::shared_ptr<std::atomic<int>> calls_inside_ = std::make_shared<std::atomic<int>>(0);  // the system
};

/// "LIBUSB_ERROR_ACCESS" and the like, for people.
std::string usb_error(int error);

}  // namespace tunnelrig
