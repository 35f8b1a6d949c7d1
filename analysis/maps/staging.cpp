#include "analysis/maps/staging.h"

#include "datasets/error.h"

#include <cerrno>
#include <cstdlib>
#include <system_error>

namespace tunnelrig {

Staging::Staging(const std::filesystem::path& target, const std::string& what)
    : target_(target), folders_(target) {
  std::error_code error;
  std::filesystem::create_directories(target, error);
  std::string name = (target / ".scratch-XXXXXX").string();
  if (error || ::mkdtemp(name.data()) == nullptr) {
    throw InputError::in(target.string(), "{} cannot be written here: {}", what,
                         error ? error.message() : std::generic_category().message(errno));
  }
  path_ = name;
}

Staging::~Staging() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
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
