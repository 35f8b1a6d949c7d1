#include "simulated/usb_bus.h"

#include "simulated/device_text.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <utility>

#include <linux/usbdevice_fs.h>
#include <pthread.h>
#include <sys/ioctl.h>
#include <umockdev.h>

namespace tunnelrig::simulated {
namespace {

constexpr const char* kSysPath = "/sys/devices/usb1/1-1";
constexpr int kFullSpeedPackets = 19;  // of 64 bytes in a frame of 1 ms

/// One per process: libusb's udev and the testbed's preloaded library both keep global state.
UMockdevTestbed* testbed() {
  static UMockdevTestbed* bed = umockdev_testbed_new();
  return bed;
}

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void require(bool good, GError* error) {
  if (!good) throw std::runtime_error(error != nullptr ? error->message : "umockdev failed");
}

double seconds_of(clockid_t clock) {
  timespec used{};
  ::clock_gettime(clock, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace

UsbBus::UsbBus(Board& board, Pace pace)
    : board_(board), pace_(pace), handler_(umockdev_ioctl_base_new()), number_(1) {
  testbed();
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(on_ioctl), this);
  g_signal_connect(handler_, "client-vanished", G_CALLBACK(on_close), this);
  worker_ = std::thread([this] { work(); });
}

UsbBus::~UsbBus() {
  bool plugged = false;
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
    deaf_ = false;
    plugged = !gone_;
  }
  wake_.notify_all();
  worker_.join();
  if (plugged) unplug();
  g_object_unref(handler_);
}

void UsbBus::plug() {
  std::string text;
  {
    const std::lock_guard lock(mutex_);
    static int newest = 1;
    number_ = ++newest;
    char node[32];
    std::snprintf(node, sizeof node, "/dev/bus/usb/001/%03d", number_);
    node_ = node;
    board_.enumerate();  // a kernel would have done it
    text = device_text(board_, number_, node_);
    mangled_.clear();
    mangled_used_ = 0;
    clock_s_ = now_s();
  }
  GError* error = nullptr;
  require(umockdev_testbed_add_from_string(testbed(), text.c_str(), &error) != 0, error);
  require(umockdev_testbed_attach_ioctl(testbed(), node_.c_str(), handler_, &error) != 0, error);
  char* root = umockdev_testbed_get_root_dir(testbed());
  const std::string path = root + node_;
  g_free(root);
  {
    const std::lock_guard lock(mutex_);
    umockdev_testbed_disable(testbed());
    const bool made = gate_.make(path);
    umockdev_testbed_enable(testbed());
    require(made, nullptr);
    gone_ = false;
  }
  umockdev_testbed_uevent(testbed(), kSysPath, "add");
}

void UsbBus::unplug() {
  {
    const std::lock_guard lock(mutex_);
    gone_ = true;
    while (!pending_.empty()) {
      usbdevfs_urb* urb = pending_.front();
      pending_.pop_front();
      complete(urb, -ESHUTDOWN);
    }
    cancelled_.clear();
    claimed_by_ = nullptr;
    gate_.show(true);
    board_.controller.reset();
  }
  umockdev_testbed_uevent(testbed(), kSysPath, "remove");
  umockdev_testbed_detach_ioctl(testbed(), node_.c_str(), nullptr);
  umockdev_testbed_remove_device(testbed(), kSysPath);
}

void UsbBus::set_deaf(bool deaf) {
  const std::lock_guard lock(mutex_);
  deaf_ = deaf;
  if (deaf) return;
  for (usbdevfs_urb* urb : std::exchange(cancelled_, {})) cancel(urb);
  std::erase_if(pending_, [this](usbdevfs_urb* urb) {
    if (urb->type != USBDEVFS_URB_TYPE_CONTROL) return false;
    answer(urb);
    return true;
  });
}

bool UsbBus::fail_transfer(int error, bool keep) {
  const std::lock_guard lock(mutex_);
  if (pending_.empty()) return false;
  usbdevfs_urb* urb = pending_.front();
  pending_.pop_front();
  if (!keep) urb->actual_length = 0;
  complete(urb, -error);
  return true;
}

void UsbBus::set_mangle(Mangle mangle) {
  const std::lock_guard lock(mutex_);
  mangle_ = std::move(mangle);
}

void UsbBus::with_board(const std::function<void(Board&)>& look) {
  const std::lock_guard lock(mutex_);
  look(board_);
}

double UsbBus::processor_s() {
  clockid_t clock{};
  ::pthread_getcpuclockid(worker_.native_handle(), &clock);
  const std::lock_guard lock(mutex_);
  return seconds_of(clock) + ioctl_processor_s_;
}

// --- everything below with the lock held, but for work() and on_ioctl()

void UsbBus::complete(usbdevfs_urb* urb, int status) {
  urb->status = status;
  done_[number_].push_back(urb);
  gate_.show(true);
}

/// Moves packets into `urb`; true where it is finished, with its status.
bool UsbBus::fill(usbdevfs_urb& urb, int& budget, int& status) {
  while (budget > 0) {
    auto* to = static_cast<std::uint8_t*>(urb.buffer) + urb.actual_length;
    const auto room = static_cast<std::size_t>(urb.buffer_length - urb.actual_length);
    status = 0;
    int size = 0;
    if (mangle_) {
      if (mangled_used_ == mangled_.size() && !mangled_end_) {
        mangled_.clear();
        mangled_used_ = 0;
        std::array<std::uint8_t, USB_PACKET> packet{};
        const int got = board_.controller.in_packet(packet.data(), packet.size());
        if (got == kNak) return false;
        if (got < 0) {
          status = -EPIPE;
          return true;
        }
        mangle_(packet.data(), static_cast<std::size_t>(got), mangled_);
        mangled_end_ = got < USB_PACKET;
      }
      const std::size_t take = std::min(room, mangled_.size() - mangled_used_);
      if (take > 0) std::memcpy(to, mangled_.data() + mangled_used_, take);
      mangled_used_ += take;
      size = static_cast<int>(take);
      urb.actual_length += size;
      --budget;
      if (mangled_end_ && mangled_used_ == mangled_.size()) {
        mangled_end_ = false;
        return true;
      }
      if (urb.actual_length == urb.buffer_length) return true;
      continue;
    }
    size = board_.controller.in_packet(to, room);
    if (size == kNak) return false;
    if (size < 0) {
      status = size == kBabble ? -EOVERFLOW : -EPIPE;
      return true;
    }
    --budget;
    urb.actual_length += size;
    if (size < USB_PACKET || urb.actual_length == urb.buffer_length) return true;
  }
  return false;
}

int UsbBus::service(int budget) {
  const int before = budget;
  while (!pending_.empty() && budget > 0) {
    board_.poll();
    int status = 0;
    if (!fill(*pending_.front(), budget, status)) {
      if (pace_ != Pace::kUnlimited || !board_.running() || ring_count(&board_.core.ring) < TRW_MAX_FRAMES)
        break;
      continue;  // only the transfer had ended; there is more in the ring
    }
    usbdevfs_urb* urb = pending_.front();
    pending_.pop_front();
    complete(urb, status);
  }
  return before - budget;
}

void UsbBus::step_clock(double now) {
  if (pace_ == Pace::kUnlimited || pace_ == Pace::kFullSpeed) {
    board_.fill();
    return;
  }
  const double frame_s = 1 / board_.frame_rate_hz();
  const auto frames = static_cast<std::uint64_t>(std::max(0.0, (now - clock_s_) / frame_s));
  board_.advance(frames);
  clock_s_ += static_cast<double>(frames) * frame_s;
}

void UsbBus::work() {
  auto next = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  while (!quit_) {
    step_clock(now_s());
    int moved = 0;
    if (!gone_ && !deaf_) moved = service(pace_ == Pace::kFullSpeed ? kFullSpeedPackets : 2048);
    if (pace_ == Pace::kUnlimited && moved > 0) {
      lock.unlock();  // let the host in
      std::this_thread::yield();
      lock.lock();
      continue;
    }
    if (pace_ == Pace::kUnlimited) {
      wake_.wait_for(lock, std::chrono::milliseconds(1));
    } else {
      lock.unlock();
      next += std::chrono::milliseconds(1);
      std::this_thread::sleep_until(next);
      lock.lock();
    }
  }
}

long UsbBus::submit(usbdevfs_urb* urb) {
  urb->actual_length = 0;
  urb->status = -EINPROGRESS;
  if (deaf_ || urb->type != USBDEVFS_URB_TYPE_CONTROL) {
    pending_.push_back(urb);
    wake_.notify_all();
  } else {
    answer(urb);
  }
  return 0;
}

void UsbBus::answer(usbdevfs_urb* urb) {
  auto* setup = static_cast<std::uint8_t*>(urb->buffer);
  const int size = board_.controller.control(setup, setup + 8);
  if (size >= 0) urb->actual_length = size;
  complete(urb, size == kStall ? -EPIPE : size < 0 ? -EPROTO : 0);
}

bool UsbBus::cancel(usbdevfs_urb* urb) {
  if (std::erase(pending_, urb) == 0) return false;
  complete(urb, -ENOENT);
  return true;
}

long UsbBus::discard(usbdevfs_urb* urb, int& error) {
  if (deaf_) {
    cancelled_.push_back(urb);  // accepted, and then nothing until the bus comes back
    return 0;
  }
  if (cancel(urb)) return 0;
  error = gone_ ? ENODEV : EINVAL;
  return -1;
}

long UsbBus::reap(void** urb, int number, bool dead, int& error) {
  std::deque<usbdevfs_urb*>& done = done_[number];
  if (done.empty()) {
    error = dead ? ENODEV : EAGAIN;
    if (!dead) gate_.show(false);
    return -1;
  }
  *urb = done.front();
  done.pop_front();
  if (done.empty() && !dead) gate_.show(false);
  return 0;
}

/// As a kernel does: of one opened file, until that is closed.
long UsbBus::claim(const void* file, int& error) {
  if (claimed_by_ != nullptr && claimed_by_ != file) {
    error = EBUSY;
    return -1;
  }
  claimed_by_ = file;
  return 0;
}

void UsbBus::on_close(_UMockdevIoctlBase* /*base*/, _UMockdevIoctlClient* file, void* context) {
  auto& self = *static_cast<UsbBus*>(context);
  const std::lock_guard lock(self.mutex_);
  if (self.claimed_by_ == file) self.claimed_by_ = nullptr;
}

long UsbBus::ioctl(unsigned long request, void* argument, const void* file, int number, int& error) {
  const bool dead = gone_ || number != number_;
  if (request == static_cast<unsigned>(USBDEVFS_REAPURBNDELAY))
    return reap(static_cast<void**>(argument), number, dead, error);
  if (request == static_cast<unsigned>(USBDEVFS_GET_CAPABILITIES)) {
    *static_cast<std::uint32_t*>(argument) =
        USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
    return 0;
  }
  if (request == static_cast<unsigned>(USBDEVFS_DISCARDURB))
    return discard(static_cast<usbdevfs_urb*>(argument), error);
  if (dead) {
    error = ENODEV;
    return -1;
  }
  switch (request) {
    case static_cast<unsigned>(USBDEVFS_SUBMITURB):
      return submit(static_cast<usbdevfs_urb*>(argument));
    case static_cast<unsigned>(USBDEVFS_CLAIMINTERFACE):
      return claim(file, error);
    case static_cast<unsigned>(USBDEVFS_RELEASEINTERFACE):
      if (claimed_by_ == file) claimed_by_ = nullptr;
      return 0;
    case static_cast<unsigned>(USBDEVFS_CLEAR_HALT):
      board_.control(0x02, 1, 0, static_cast<std::uint16_t>(*static_cast<unsigned*>(argument)), 0, nullptr);
      return 0;
    default:
      error = ENOTTY;
      return -1;
  }
}

int UsbBus::on_ioctl(_UMockdevIoctlBase* /*base*/, _UMockdevIoctlClient* client, void* context) {
  auto& self = *static_cast<UsbBus*>(context);
  const unsigned long request = static_cast<unsigned>(umockdev_ioctl_client_get_request(client));
  void* argument = *reinterpret_cast<void**>(umockdev_ioctl_client_get_arg(client)->data);
  const int number = std::atoi(umockdev_ioctl_client_get_devnode(client) + std::strlen("/dev/bus/usb/001/"));
  int error = 0;
  long result = 0;
  {
    const std::lock_guard lock(self.mutex_);
    result = self.ioctl(request, argument, client, number, error);
    self.ioctl_processor_s_ = seconds_of(CLOCK_THREAD_CPUTIME_ID);
  }
  umockdev_ioctl_client_complete(client, result, error);
  return 1;
}

}  // namespace tunnelrig::simulated

#ifdef __SANITIZE_THREAD__
// What a kernel would do, ThreadSanitizer does not see as handing memory over: it comes by umockdev's own
// ways. Races between the logger's threads are still found.
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "race:tunnelrig::simulated::UsbBus\nrace:libumockdev.so\n";
}
#endif
