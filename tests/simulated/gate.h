// A node in /dev that is ready when we say so: of a regular file poll() says always, and libusb would spin.
#pragma once

#include <string>

namespace tunnelrig::simulated {

/// A FIFO at whose end libusb waits to write. Used under the lock of its bus.
class Gate {
 public:
  Gate() = default;
  ~Gate();
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  /// In place of the file at `path`, closed; false where it cannot be made.
  bool make(const std::string& path);
  void show(bool ready);

 private:
  int fd_ = -1;
  bool full_ = false;
};

}  // namespace tunnelrig::simulated
