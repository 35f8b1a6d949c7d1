#include "datasets/recorder_lock.h"

#include "datasets/error.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

class Lock {
 public:
  Lock(int fd, std::string file) : fd_(fd), file_(std::move(file)) {}
  ~Lock() {
    ::unlink(file_.c_str());
    ::close(fd_);
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  int fd_;
  std::string file_;
};

/// Another process may have removed the file between our open and our lock; then we hold a lock on nothing.
bool still_the_file(int fd, const std::string& file) {
  struct stat held {
  }, named{};
  return ::fstat(fd, &held) == 0 && ::stat(file.c_str(), &named) == 0 && held.st_ino == named.st_ino &&
         held.st_dev == named.st_dev;
}

/// The process id in the file, for messages; the lock holds without it (a full disk, say).
std::string read_pid(int fd) {
  std::array<char, 32> pid{};
  const ssize_t length = ::pread(fd, pid.data(), pid.size() - 1, 0);
  return length > 0 ? pid.data() : "unknown";
}

/// Who only looks (recorder_of) holds the lock for an instant: that is no recorder.
bool try_lock(int fd) {
  constexpr int kTries = 5;
  for (int i = 0; i < kTries; ++i) {
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

}  // namespace

std::shared_ptr<void> lock_for_recording(const std::filesystem::path& campaign) {
  const std::string file = campaign.string() + ".lock";
  while (true) {
    const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (fd < 0) {
      throw InputError::in(campaign.string(), "cannot be written: {}",
                           std::generic_category().message(errno));
    }
    if (!try_lock(fd)) {
      const std::string pid = read_pid(fd);
      ::close(fd);
      throw InputError::in(campaign.string(), "is being recorded to by process {}; one recorder per file",
                           pid);
    }
    if (!still_the_file(fd, file)) {
      ::close(fd);
      continue;
    }
    const std::string pid = std::to_string(::getpid());
    if (::ftruncate(fd, 0) != 0 || ::write(fd, pid.data(), pid.size()) < 0) {
      // The process id is only there for the message above; the lock holds without it (a full disk, say).
    }
    return std::make_shared<Lock>(fd, file);
  }
}

std::optional<std::string> recorder_of(const std::filesystem::path& campaign) {
  const int fd = ::open((campaign.string() + ".lock").c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return {};
  std::optional<std::string> pid;
  if (::flock(fd, LOCK_SH | LOCK_NB) != 0) pid = read_pid(fd);
  ::close(fd);
  return pid;
}

}  // namespace tunnelrig
