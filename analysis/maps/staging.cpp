#include "analysis/maps/staging.h"

#include "datasets/error.h"

#include <cerrno>
#include <cstdlib>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kScratch = ".tunnelrig-scratch-", kAnyName = "XXXXXX";

int open_folder(const fs::path& folder) {
  return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

bool still_there(int fd, const fs::path& folder) {
  struct stat held {
  }, named{};
  return ::fstat(fd, &held) == 0 && ::stat(folder.c_str(), &named) == 0 && held.st_ino == named.st_ino &&
         held.st_dev == named.st_dev;
}

/// Made by this user as mkdtemp makes it.
bool is_own(int fd) {
  struct stat found {};
  return ::fstat(fd, &found) == 0 && found.st_uid == ::geteuid() && (found.st_mode & 0777) == 0700;
}

/// Waits for whoever looks at it.
void lock(int fd) {
  while (::flock(fd, LOCK_EX) != 0 && errno == EINTR) {
  }
}

/// Scratch folders of programs that were killed: the kernel has dropped their locks.
void remove_abandoned(const fs::path& target) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(target, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kScratch) || name.size() != kScratch.size() + kAnyName.size()) continue;
    const int fd = open_folder(entry.path());
    if (fd < 0) continue;
    if (is_own(fd) && ::flock(fd, LOCK_EX | LOCK_NB) == 0) fs::remove_all(entry.path(), error);
    ::close(fd);
  }
}

}  // namespace

Staging::Staging(const fs::path& target, const std::string& what) : target_(target), folders_(target) {
  std::error_code error;
  fs::create_directories(target, error);
  if (!error) remove_abandoned(target);
  while (true) {
    std::string name = (target / kScratch).string() + std::string(kAnyName);
    if (error || ::mkdtemp(name.data()) == nullptr) {
      throw InputError::in(target.string(), "{} cannot be written here: {}", what,
                           error ? error.message() : std::generic_category().message(errno));
    }
    path_ = name;
    lock_ = open_folder(path_);
    // Between its making and its lock another program may have taken it for abandoned.
    if (lock_ < 0 && errno == ENOENT) continue;
    if (lock_ < 0) return;
    lock(lock_);
    if (still_there(lock_, path_)) return;
    ::close(lock_);
  }
}

Staging::~Staging() {
  std::error_code error;
  fs::remove_all(path_, error);
  if (lock_ >= 0) ::close(lock_);
}

std::vector<std::filesystem::path> Staging::publish(const std::vector<std::string>& names) const {
  std::vector<std::filesystem::path> files;
  for (const std::string& name : names) {
    files.push_back(target_ / name);
    if (std::filesystem::is_directory(files.back()))
      throw InputError::in(files.back().string(), "is a folder where a file is to be written");
    const std::filesystem::path folder = files.back().parent_path();
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw InputError::in(folder.string(), "cannot be made: {}", error.message());
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::error_code error;
    std::filesystem::rename(path_ / names[i], files[i], error);
    if (error) throw InputError::in(files[i].string(), "cannot be written: {}", error.message());
  }
  return files;
}

}  // namespace tunnelrig
