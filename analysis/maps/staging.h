// Files that appear all or none: made in a scratch folder first, then renamed to their place.
#pragma once

#include "datasets/output_place.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace tunnelrig {

/// A scratch folder within the target, so that renaming out of it stays on one file system; gone afterwards,
/// and the target with it where it was made for this and nothing was published. What a program leaves that is
/// killed meanwhile goes with the next one into the same target.
class Staging {
 public:
  /// Makes the target where it is missing. Throws InputError naming it where that cannot be, with `what` is
  /// not to be written ("maps").
  Staging(const std::filesystem::path& target, const std::string& what);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// Calls `write`, which writes to `path()`; where it fails its message names the target (output_place.h).
  void write(const std::function<void()>& write) const { write_as(target_, path_, write); }

  /// Renames files of the scratch folder, by their names in it ("a", "b/a"), into the target, after a look at
  /// what alone could stop that half-way. Returns where they are now; throws InputError naming the file that
  /// is in the way.
  std::vector<std::filesystem::path> publish(const std::vector<std::string>& names) const;

 private:
  std::filesystem::path target_, path_;
  int lock_ = -1;  // on the scratch folder, as long as this program lives
  FoldersForOutput folders_;
};

}  // namespace tunnelrig
