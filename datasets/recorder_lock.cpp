#include "datasets/recorder_lock.h"

#include "datasets/error.h"

#include <array>
#include <cerrno>
#include <system_error>

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

}  // namespace

std::shared_ptr<void> lock_for_recording(const std::filesystem::path& campaign) {
  const std::string file = campaign.string() + ".lock";
  while (true) {
    const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (fd < 0) {
      throw InputError::in(campaign.string(), "cannot be written: {}",
                           std::generic_category().message(errno));
    }
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
      std::array<char, 32> pid{};
      const ssize_t length = ::read(fd, pid.data(), pid.size() - 1);
      ::close(fd);
      throw InputError::in(campaign.string(), "is being recorded to by process {}; one recorder per file",
                           length > 0 ? pid.data() : "unknown");
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

}  // namespace tunnelrig
