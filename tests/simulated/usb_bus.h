// A USB bus of one board under the real libusb: umockdev shows the device to udev and passes libusb's ioctls
// to us. No kernel is in it; the integration stage has one. Simulated.
#pragma once

#include "simulated/board.h"
#include "simulated/gate.h"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

struct usbdevfs_urb;
struct _UMockdevIoctlBase;    // NOLINT(bugprone-reserved-identifier): umockdev's own names
struct _UMockdevIoctlClient;  // NOLINT(bugprone-reserved-identifier)

namespace tunnelrig::simulated {

enum class Pace {
  kRig,
  kFullSpeed,
  kUnlimited
};  // real-time samples; 19 packets per ms and no more; as fast as read

/// What becomes of each packet on the bus: appends to `out` what the host sees. (No real bus does this to
/// bulk data; bad hubs, drivers and firmware do.)
using Mangle =
    std::function<void(const std::uint8_t* data, std::size_t size, std::vector<std::uint8_t>& out)>;

class UsbBus {
 public:
  explicit UsbBus(Board& board, Pace pace);
  ~UsbBus();
  UsbBus(const UsbBus&) = delete;
  UsbBus& operator=(const UsbBus&) = delete;

  void plug();
  void unplug();

  /// Nothing is completed and nothing cancelled meanwhile: a hung host controller.
  void set_deaf(bool deaf);

  /// The oldest pending transfer ends with `error` (a positive errno); what it held already is `keep` or
  /// lost. False where none is pending.
  bool fail_transfer(int error, bool keep);

  void set_mangle(Mangle mangle);

  /// Processor time so far of the board's thread and of umockdev's, which answers the ioctls.
  double processor_s();

  /// The board may be looked at, or made to stumble, under this lock only.
  void with_board(const std::function<void(Board&)>& look);

 private:
  void work();
  void step_clock(double now_s);
  int service(int budget);
  bool fill(usbdevfs_urb& urb, int& budget, int& status);
  void complete(usbdevfs_urb* urb, int status);
  long ioctl(unsigned long request, void* argument, const void* file, int number, int& error);
  long claim(const void* file, int& error);
  long reap(void** urb, int number, bool dead, int& error);
  long submit(usbdevfs_urb* urb);
  void answer(usbdevfs_urb* urb);
  bool cancel(usbdevfs_urb* urb);
  long discard(usbdevfs_urb* urb, int& error);
  static int on_ioctl(_UMockdevIoctlBase*, _UMockdevIoctlClient* client, void* self);
  static void on_close(_UMockdevIoctlBase*, _UMockdevIoctlClient* file, void* self);

  Board& board_;
  Pace pace_;
  _UMockdevIoctlBase* handler_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<usbdevfs_urb*> pending_;
  std::vector<usbdevfs_urb*> cancelled_;           // while it was deaf
  std::map<int, std::deque<usbdevfs_urb*>> done_;  // by device number: one that is gone is still reaped
  std::vector<std::uint8_t> mangled_;              // bytes on the wire that no transfer has taken yet
  std::size_t mangled_used_ = 0;
  bool mangled_end_ = false;  // a short packet stands at their end
  Mangle mangle_;
  bool gone_ = true, deaf_ = false, quit_ = false;
  Gate gate_;
  const void* claimed_by_ = nullptr;
  int number_;
  double clock_s_ = 0;
  double ioctl_processor_s_ = 0;
  std::string node_;
  std::thread worker_;
};

}  // namespace tunnelrig::simulated
