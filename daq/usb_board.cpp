#include "daq/usb_board.h"

#include <array>

#include <fmt/format.h>
#include <libusb-1.0/libusb.h>

namespace tunnelrig {
namespace {

constexpr std::uint8_t kVendorIn = 0xC0, kVendorOut = 0x40;
constexpr const char* kPermissionAdvice =
    "no permission; install daq/60-tunnelrig.rules as /etc/udev/rules.d/60-tunnelrig.rules, run `udevadm "
    "control "
    "--reload`, and plug the board in again";

/// The devices that carry the board's numbers, referenced until this ends.
class Candidates {
 public:
  explicit Candidates(libusb_context* context) {
    libusb_device** list = nullptr;
    const ssize_t count = libusb_get_device_list(context, &list);
    for (ssize_t i = 0; i < count; ++i) {
      libusb_device_descriptor descriptor{};
      if (libusb_get_device_descriptor(list[i], &descriptor) == 0 && descriptor.idVendor == TRW_USB_VENDOR &&
          descriptor.idProduct == TRW_USB_PRODUCT)
        devices_.push_back(libusb_ref_device(list[i]));
    }
    if (count >= 0) libusb_free_device_list(list, 1);
  }
  ~Candidates() {
    for (libusb_device* device : devices_) libusb_unref_device(device);
  }
  Candidates(const Candidates&) = delete;
  Candidates& operator=(const Candidates&) = delete;

  const std::vector<libusb_device*>& devices() const { return devices_; }

 private:
  std::vector<libusb_device*> devices_;
};

std::string open_problem(int error) {
  return error == LIBUSB_ERROR_ACCESS ? kPermissionAdvice : usb_error(error);
}

/// String descriptor 3; ours is ASCII.
std::string serial_of(UsbHandle& handle) {
  std::array<std::uint8_t, 255> data{};
  const int size = handle.control(0x80, 6, 0x0303, 0x0409, data);
  std::string serial;
  for (int i = 2; i + 1 < size; i += 2) serial += static_cast<char>(data[static_cast<std::size_t>(i)]);
  return serial;
}

}  // namespace

bool UsbBoard::identify() {
  std::array<std::uint8_t, TRW_IDENTITY_SIZE> data{};
  const int size = handle_->control(kVendorIn, TRW_USB_IDENTIFY, 0, 0, data);
  return size > 0 && trw_get_identity(data.data(), static_cast<std::size_t>(size), &identity_);
}

bool UsbBoard::command(std::uint8_t request, std::uint16_t value) {
  return handle_->control(kVendorOut, request, value, 0, {}) >= 0;
}

bool UsbBoard::start(bool pattern) {
  return command(TRW_USB_START, pattern ? TRW_PATTERN_COUNTER : TRW_PATTERN_OFF);
}

bool UsbBoard::stop() { return command(TRW_USB_STOP, 0); }

bool UsbBoard::reboot_to_loader() { return command(TRW_USB_LOADER, TRW_USB_LOADER_KEY); }

bool UsbBoard::set_rate(const trw_rate_wish& wish) {
  std::array<std::uint8_t, TRW_RATE_WISH_SIZE> data{};
  trw_put_rate_wish(data.data(), &wish);
  return handle_->control(kVendorOut, TRW_USB_SET_RATE, 0, 0, data) == TRW_RATE_WISH_SIZE;
}

std::optional<trw_rate> UsbBoard::rate() {
  std::array<std::uint8_t, TRW_RATE_SIZE> data{};
  if (handle_->control(kVendorIn, TRW_USB_GET_RATE, 0, 0, data) != TRW_RATE_SIZE) return {};
  trw_rate rate{};
  trw_get_rate(data.data(), &rate);
  return rate;
}

std::optional<trw_statistics> UsbBoard::statistics() {
  std::array<std::uint8_t, TRW_STATISTICS_SIZE> data{};
  if (handle_->control(kVendorIn, TRW_USB_STATISTICS, 0, 0, data) != TRW_STATISTICS_SIZE) return {};
  trw_statistics statistics{};
  trw_get_statistics(data.data(), &statistics);
  return statistics;
}

std::unique_ptr<UsbBoard> UsbBoard::open(const std::shared_ptr<UsbBus>& bus, const std::string& serial,
                                         std::string& why) {
  const Candidates candidates(bus->context());
  std::vector<std::unique_ptr<UsbBoard>> matching;
  std::string others;
  why.clear();
  for (libusb_device* device : candidates.devices()) {
    int error = 0;
    auto handle = UsbHandle::open(bus, device, error);
    if (handle == nullptr) {
      why = open_problem(error);
      continue;
    }
    const std::string found = serial_of(*handle);
    if (found.starts_with(serial) && !found.empty())
      matching.emplace_back(new UsbBoard(std::move(handle), found));
    else
      others += (others.empty() ? "" : ", ") + (found.empty() ? "one that does not answer" : found);
  }
  if (matching.size() > 1) {
    why = "several boards fit; name one by its serial number (`tunnelrig devices`)";
    return nullptr;
  }
  if (matching.empty()) {
    if (why.empty())
      why = others.empty()   ? "no board is plugged in"
            : serial.empty() ? "the board that is plugged in does not answer"
                             : fmt::format("no board of serial number {}; there are {}", serial, others);
    return nullptr;
  }
  std::unique_ptr<UsbBoard> board = std::move(matching.front());
  const int error = board->handle_->claim(TRW_USB_INTERFACE);
  if (error != 0) {
    why = error == LIBUSB_ERROR_BUSY ? "the board is in use by another program" : usb_error(error);
    return nullptr;
  }
  if (!board->identify()) {
    why = "the board does not say who it is; it is none of ours, or its firmware hangs";
    return nullptr;
  }
  if (board->identity_.protocol != TRW_USB_PROTOCOL) {
    why = fmt::format("the board speaks protocol {}, this program {}; flash the firmware of this version",
                      board->identity_.protocol, static_cast<int>(TRW_USB_PROTOCOL));
    return nullptr;
  }
  if (board->identity_.tick_hz == 0) {
    why = "the board says that its clock runs at 0 Hz, so nothing of it has a time; flash its firmware anew";
    return nullptr;
  }
  return board;
}

std::vector<UsbDevice> list_usb_boards() {
  const auto bus = std::make_shared<UsbBus>();
  const Candidates candidates(bus->context());
  std::vector<UsbDevice> found;
  for (libusb_device* device : candidates.devices()) {
    UsbDevice entry{.bus = libusb_get_bus_number(device), .address = libusb_get_device_address(device)};
    int error = 0;
    if (auto handle = UsbHandle::open(bus, device, error)) {
      entry.serial = serial_of(*handle);
      UsbBoard board(std::move(handle), entry.serial);
      if (board.identify()) {
        entry.identity = board.identity();
        entry.rate = board.rate();
        entry.statistics = board.statistics();
      } else {
        entry.problem = "does not answer";
      }
    } else {
      entry.problem = open_problem(error);
      entry.no_permission = error == LIBUSB_ERROR_ACCESS;
    }
    found.push_back(std::move(entry));
  }
  return found;
}

}  // namespace tunnelrig
