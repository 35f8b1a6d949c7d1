#include "datasets/output_place.h"

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
