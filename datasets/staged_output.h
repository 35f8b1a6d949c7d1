// What the user asked to have written appears whole or not at all.
#pragma once

#include <filesystem>

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

  /// Throws InputError where something has come to stand in the target's place meanwhile.
  void publish();

 private:
  std::filesystem::path target_, staged_;
  Kind kind_;
};

}  // namespace tunnelrig
