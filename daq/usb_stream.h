// The stream endpoint of a board: several large transfers always in flight, their bytes in a bounded queue.
#pragma once

#include "daq/usb_bus.h"

#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace tunnelrig {

struct UsbStreamSettings {
  int transfers = 8;
  std::size_t transfer_bytes = 32768;                // a multiple of the packet size, so that none overflows
  std::chrono::milliseconds transfer_timeout{5000};  // never 0, which means for ever
  std::size_t queue_bytes = std::size_t{4} << 20;    // above this the board has to wait
  std::chrono::milliseconds drain_wait{200};         // for cancelled transfers to come back
};

/// Reads from the endpoint from construction to destruction.
class UsbStream {
 public:
  enum class Status { kData, kNothing, kBroken };
  struct Got {
    Status status = Status::kNothing;
    std::size_t size = 0;
    double time_s = 0;            // when the bytes came in
    const char* cause = nullptr;  // what went wrong before these bytes, or why it broke
  };

  UsbStream(std::shared_ptr<UsbHandle> handle, const UsbStreamSettings& settings);
  ~UsbStream();
  UsbStream(const UsbStream&) = delete;
  UsbStream& operator=(const UsbStream&) = delete;

  /// Bytes that came in one transfer and that nobody has read.
  struct Unread {
    std::vector<std::byte> bytes;
    double time_s = 0;            // when they came in
    const char* cause = nullptr;  // what went wrong before them
  };

  /// Waits for bytes, at most for `timeout` (and where the endpoint has to be cleared of a stall, 0.5 s
  /// more).
  Got read(std::span<std::byte> buffer, std::chrono::milliseconds timeout);

  /// Ends the stream; what has come and was not read. Waits at most for the settings' drain_wait.
  std::vector<Unread> finish();

  /// Throws away what has come so far, until nothing came for `quiet`; back within 10 × `quiet`.
  void discard(std::chrono::milliseconds quiet);

 private:
  struct State;
  void start();
  bool stop();
  bool recover_from_stall();

  UsbStreamSettings settings_;
  std::shared_ptr<UsbHandle> handle_;
  std::shared_ptr<State> state_;
};

}  // namespace tunnelrig
