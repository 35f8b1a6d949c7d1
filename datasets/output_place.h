// Where output goes: the folders that are made for it, and what it is called where it fails.
#pragma once

#include <filesystem>
#include <functional>
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

/// Calls `write`, which makes as `staged`, or in it, what the user has asked for as `target`. Its InputErrors
/// then name the target, which is all that the user knows of; what the file system refuses is an InputError
/// too.
void write_as(const std::filesystem::path& target, const std::filesystem::path& staged,
              const std::function<void()>& write);

}  // namespace tunnelrig
