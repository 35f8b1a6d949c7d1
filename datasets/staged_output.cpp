#include "datasets/staged_output.h"

#include "datasets/error.h"

#include <cerrno>
#include <cstdio>  // renameat2 as well
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;

/// "out/" is "out": what is staged stands beside it, not in it.
fs::path without_slash(const fs::path& target) {
  const fs::path normal = target.lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

[[noreturn]] void refuse_existing(const fs::path& target, StagedOutput::Kind kind) {
  throw InputError::in(target.string(), "{}; export never overwrites",
                       kind == StagedOutput::Kind::kFolder ? "exists and is not an empty folder" : "exists");
}

}  // namespace

StagedOutput::StagedOutput(const fs::path& target, Kind kind)
    : target_(without_slash(target)), above_(target_.parent_path()), kind_(kind) {
  if (target_.empty()) throw InputError("the name of what is to be written is empty");
  std::error_code error;
  const bool taken = fs::exists(fs::symlink_status(target_, error));
  const bool empty_folder = fs::is_directory(target_, error) && fs::is_empty(target_, error);
  if (taken && !(kind == Kind::kFolder && empty_folder)) refuse_existing(target_, kind);
  staged_ = target_.string() + fmt::format(".{}.part", ::getpid());
  fs::remove_all(staged_, error);
  if (kind == Kind::kFolder) {
    fs::create_directories(staged_, error);
    if (error) throw InputError::in(target_.string(), "cannot be written: {}", error.message());
  } else if (const fs::path place = fs::absolute(target_).parent_path(); !fs::is_directory(place, error)) {
    throw InputError::in(target_.string(), "cannot be written: there is no folder {}", place.string());
  } else if (::access(place.c_str(), W_OK) != 0) {
    throw InputError::in(target_.string(), "cannot be written: {}", std::generic_category().message(errno));
  }
}

StagedOutput::~StagedOutput() {
  std::error_code error;
  fs::remove_all(staged_, error);
}

void StagedOutput::publish() {
  // A file that came into being meanwhile must not be replaced; where the file system has no such renaming,
  // the check at the start has to do. A folder never replaces one that holds something.
  const unsigned how = kind_ == Kind::kFile ? RENAME_NOREPLACE : 0;
  if (::renameat2(AT_FDCWD, staged_.c_str(), AT_FDCWD, target_.c_str(), how) == 0) return;
  if (errno == EEXIST || errno == ENOTEMPTY || errno == ENOTDIR) refuse_existing(target_, kind_);
  std::error_code error;
  fs::rename(staged_, target_, error);
  if (error) throw InputError::in(target_.string(), "cannot be written: {}", error.message());
}

}  // namespace tunnelrig
