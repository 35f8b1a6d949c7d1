#include "daq/usb_bus.h"

#include "datasets/error.h"

#include <condition_variable>
#include <cstring>
#include <mutex>
#include <utility>

#include <libusb-1.0/libusb.h>

namespace tunnelrig {
namespace {

constexpr std::chrono::milliseconds kEventWait{100};
constexpr std::chrono::milliseconds kGrace{100};  // for a cancelled transfer to come back
constexpr std::chrono::milliseconds kClearHaltWait{300};

/// What a call that may outlive its caller leaves behind for the callback.
struct Call {
  explicit Call(std::shared_ptr<std::atomic<int>> inside) : calls_inside(std::move(inside)) {}

  std::shared_ptr<std::atomic<int>> calls_inside;  // of its handle
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  int result = LIBUSB_ERROR_TIMEOUT;
  std::vector<std::uint8_t> buffer;

  void finish(int value) {
    const std::lock_guard lock(mutex);
    --*calls_inside;
    result = value;
    done = true;
    changed.notify_all();
  }
  bool wait(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, timeout, [&] { return done; });
  }
};

int result_of(const libusb_transfer& transfer) {
  switch (transfer.status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return transfer.actual_length;
    case LIBUSB_TRANSFER_STALL:
      return LIBUSB_ERROR_PIPE;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return LIBUSB_ERROR_NO_DEVICE;
    case LIBUSB_TRANSFER_OVERFLOW:
      return LIBUSB_ERROR_OVERFLOW;
    case LIBUSB_TRANSFER_TIMED_OUT:
    case LIBUSB_TRANSFER_CANCELLED:
      return LIBUSB_ERROR_TIMEOUT;
    default:
      return LIBUSB_ERROR_IO;
  }
}

/// The callback owns transfer and call: where it never comes, both stay, and nothing is freed under the
/// system's hands.
void LIBUSB_CALL on_control(libusb_transfer* transfer) {
  const std::unique_ptr<std::shared_ptr<Call>> call(static_cast<std::shared_ptr<Call>*>(transfer->user_data));
  (*call)->finish(result_of(*transfer));
  libusb_free_transfer(transfer);
}

void close_device(libusb_device_handle* handle, int claimed) {
  if (claimed >= 0) libusb_release_interface(handle, claimed);
  libusb_close(handle);
}

}  // namespace

UsbBus::UsbBus() {
  const int error = libusb_init(&context_);
  if (error != 0) throw InputError(fmt::format("usb: libusb cannot start: {}", usb_error(error)));
  events_ = std::thread([this] {
    while (!stop_) {
      timeval wait{0, static_cast<suseconds_t>(std::chrono::microseconds(kEventWait).count())};
      if (libusb_handle_events_timeout_completed(context_, &wait, nullptr) != 0)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      close_left();
    }
  });
}

UsbBus::~UsbBus() {
  stop_ = true;
  libusb_interrupt_event_handler(context_);
  events_.join();
  close_left();
  if (!abandoned_ && left_.empty()) libusb_exit(context_);
}

void UsbBus::leave(Left left) {
  const std::lock_guard lock(left_mutex_);
  left_.push_back(std::move(left));
}

void UsbBus::close_left() {
  const std::lock_guard lock(left_mutex_);
  std::erase_if(left_, [](const Left& left) {
    if (*left.calls_inside > 0) return false;
    close_device(left.handle, left.claimed);
    return true;
  });
}

std::shared_ptr<UsbHandle> UsbHandle::open(std::shared_ptr<UsbBus> bus, libusb_device* device, int& error) {
  libusb_device_handle* handle = nullptr;
  error = libusb_open(device, &handle);
  if (error != 0) return nullptr;
  return std::shared_ptr<UsbHandle>(new UsbHandle(std::move(bus), handle));
}

UsbHandle::~UsbHandle() {
  if (*calls_inside_ > 0)
    bus_->leave({handle_, claimed_, calls_inside_});
  else
    close_device(handle_, claimed_);
}

int UsbHandle::claim(int interface) {
  const int error = libusb_claim_interface(handle_, interface);
  if (error == 0) claimed_ = interface;
  return error;
}

int UsbHandle::control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
                       std::span<std::uint8_t> data, std::chrono::milliseconds timeout) {
  auto call = std::make_shared<Call>(calls_inside_);
  call->buffer.resize(LIBUSB_CONTROL_SETUP_SIZE + data.size());
  libusb_fill_control_setup(call->buffer.data(), type, request, value, index,
                            static_cast<std::uint16_t>(data.size()));
  if ((type & LIBUSB_ENDPOINT_IN) == 0 && !data.empty())
    std::memcpy(call->buffer.data() + LIBUSB_CONTROL_SETUP_SIZE, data.data(), data.size());
  libusb_transfer* transfer = libusb_alloc_transfer(0);
  if (transfer == nullptr) return LIBUSB_ERROR_NO_MEM;
  auto owned = std::make_unique<std::shared_ptr<Call>>(call);
  libusb_fill_control_transfer(transfer, handle_, call->buffer.data(), on_control, owned.get(),
                               static_cast<unsigned>(timeout.count()));
  ++*calls_inside_;
  const int error = libusb_submit_transfer(transfer);
  if (error != 0) {
    --*calls_inside_;
    libusb_free_transfer(transfer);
    return error;
  }
  static_cast<void>(owned.release());  // the callback's now
  // libusb has cancelled it at `timeout`; it does not come back, or later.
  if (!call->wait(timeout + kGrace)) return LIBUSB_ERROR_TIMEOUT;
  if (call->result > 0 && (type & LIBUSB_ENDPOINT_IN) != 0)
    std::memcpy(data.data(), call->buffer.data() + LIBUSB_CONTROL_SETUP_SIZE,
                static_cast<std::size_t>(call->result));
  return call->result;
}

bool UsbHandle::clear_halt(std::uint8_t endpoint) {
  auto call = std::make_shared<Call>(calls_inside_);
  ++*calls_inside_;
  std::thread([call, handle = handle_, endpoint] {
    call->finish(libusb_clear_halt(handle, endpoint));
  }).detach();
  return call->wait(kClearHaltWait) && call->result == 0;
}

std::string usb_error(int error) { return libusb_strerror(error); }

}  // namespace tunnelrig
