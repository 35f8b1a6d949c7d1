// What the user asked to have written appears whole or not at all.
#pragma once

#include "datasets/output_place.h"

#include <filesystem>
#include <functional>

namespace tunnelrig {

/// A new file or folder that is written under a temporary name beside its target ("TARGET.PID.part") and
/// renamed when it is whole. Unless it was published, it goes with this object; what a killed program leaves
/// is the temporary name.
class StagedOutput {
 public:
  enum class Kind { kFile, kFolder };

  /// A folder is made at once, a file by whoever writes to `path()`. Throws InputError where `target` exists
  /// (but for an empty folder where a folder is wanted) and where its place cannot be written to.
  StagedOutput(const std::filesystem::path& target, Kind kind);
  ~StagedOutput();
  StagedOutput(const StagedOutput&) = delete;
  StagedOutput& operator=(const StagedOutput&) = delete;

  const std::filesystem::path& path() const { return staged_; }

  /// Calls `write`, which writes to `path()`; where it fails its message names the target (output_place.h).
  void write(const std::function<void()>& write) const { write_as(target_, staged_, write); }

  /// Throws InputError where something has come to stand in the target's place meanwhile.
  void publish();

 private:
  std::filesystem::path target_, staged_;
  FoldersForOutput above_;  // the target
  Kind kind_;
};

}  // namespace tunnelrig
