#include "simulated/gate.h"

#include <array>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace tunnelrig::simulated {

Gate::~Gate() {
  if (fd_ >= 0) ::close(fd_);
}

bool Gate::make(const std::string& path) {
  ::unlink(path.c_str());
  const bool made = ::mkfifo(path.c_str(), 0666) == 0;
  const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (!made || fd < 0) return false;
  ::fcntl(fd, F_SETPIPE_SZ, 4096);  // one page: quickly filled and drained
  if (fd_ >= 0) ::close(fd_);
  fd_ = fd;
  full_ = false;
  show(false);
  return true;
}

/// A full FIFO is not writable: nothing to reap.
void Gate::show(bool ready) {
  if (fd_ < 0 || ready != full_) return;
  std::array<char, 4096> bytes{};
  if (ready) {
    while (::read(fd_, bytes.data(), bytes.size()) > 0) {
    }
  } else {
    while (::write(fd_, bytes.data(), bytes.size()) > 0) {
    }
  }
  full_ = !ready;
}

}  // namespace tunnelrig::simulated
