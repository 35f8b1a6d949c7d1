// Where output goes: the folders that are made for it, and what it is called where it fails.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {

/// Remembers which folders on the way to `path`, itself included, are not there yet. Those that were made
/// since and hold nothing go with this object: who fails before anything is written leaves no empty folder
/// behind.
class FoldersForOutput {
 public:
  explicit FoldersForOutput(const std::filesystem::path& path);
  ~FoldersForOutput();
  FoldersForOutput(const FoldersForOutput&) = delete;
  FoldersForOutput& operator=(const FoldersForOutput&) = delete;

 private:
  std::vector<std::filesystem::path> missing_;  // the innermost first
};

/// Options and the paths that they name, to be read or written; empty where they are not given.
using NamedPaths = std::vector<std::pair<std::string, std::string>>;

/// Whether two paths name one file or folder, which may not be there yet; of devices and pipes none does.
bool same_place(const std::filesystem::path& a, const std::filesystem::path& b);

/// Throws InputError naming both options where two of them name one file or folder: the second would be
/// written over the first. Devices and pipes take both.
void check_distinct(const NamedPaths& paths);

/// Throws InputError where write_text could not write there, before the work whose result it is: no folder to
/// write in, a folder or a campaign file in the way.
void check_can_be_written(const std::filesystem::path& path);

/// Calls `write`, which makes as `staged`, or in it, what the user has asked for as `target`. Its InputErrors
/// then name the target, which is all that the user knows of; what the file system refuses is an InputError
/// too.
void write_as(const std::filesystem::path& target, const std::filesystem::path& staged,
              const std::function<void()>& write);

}  // namespace tunnelrig
