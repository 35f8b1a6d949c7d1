#include "datasets/output_place.h"

#include "datasets/csv.h"
#include "datasets/error.h"

#include <system_error>

#include <unistd.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;

std::string with_target(std::string message, const std::string& staged, const std::string& target) {
  for (std::size_t at = 0; (at = message.find(staged, at)) != std::string::npos; at += target.size())
    message.replace(at, staged.size(), target);
  return message;
}

}  // namespace

bool same_place(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (fs::is_other(fs::status(a, error))) return false;
  return fs::weakly_canonical(fs::absolute(a, error), error) ==
         fs::weakly_canonical(fs::absolute(b, error), error);
}

void check_distinct(const NamedPaths& paths) {
  for (auto one = paths.begin(); one != paths.end(); ++one)
    for (auto other = paths.begin(); other != one; ++other)
      if (!one->second.empty() && !other->second.empty() && same_place(one->second, other->second))
        throw InputError(fmt::format("{} {}: the same place as {} {}", one->first, one->second, other->first,
                                     other->second));
}

void check_can_be_written(const fs::path& path) {
  std::error_code error;
  if (fs::is_other(fs::status(path, error))) return;
  if (fs::is_directory(path, error)) throw InputError::in(path.string(), "cannot be written: it is a folder");
  keep_campaign_files(path);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error))
    throw InputError::in(path.string(), "cannot be written: there is no folder {}", folder.string());
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    throw InputError::in(path.string(), "cannot be written: nothing can be made in {}", folder.string());
}

FoldersForOutput::FoldersForOutput(const fs::path& path) {
  std::error_code error;
  for (fs::path folder = path; !folder.empty() && !fs::exists(folder, error); folder = folder.parent_path())
    missing_.push_back(folder);
}

FoldersForOutput::~FoldersForOutput() {
  for (const fs::path& folder : missing_) ::rmdir(folder.c_str());  // refuses what is no empty folder
}

void write_as(const fs::path& target, const fs::path& staged, const std::function<void()>& write) {
  try {
    write();
  } catch (const InputError& error) {
    throw InputError(with_target(error.what(), staged.string(), target.string()));
  } catch (const fs::filesystem_error& error) {
    const std::string named = error.path1().empty() ? staged.string() : error.path1().string();
    throw InputError::in(with_target(named, staged.string(), target.string()), "cannot be written: {}",
                         error.code().message());
  }
}

}  // namespace tunnelrig
