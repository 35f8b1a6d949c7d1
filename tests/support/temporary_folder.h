#pragma once

#include <filesystem>

namespace tunnelrig::test {

/// A folder that goes with the test.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// The folder of real measurements, or an empty path where this checkout has none beside it.
std::filesystem::path shared_data();

/// Skips the running test, saying why, where the real measurements are absent.
#define SKIP_WITHOUT_SHARED_DATA()                                                       \
  do {                                                                                   \
    if (tunnelrig::test::shared_data().empty())                                          \
      GTEST_SKIP() << "the measured data (../shared/data) are not beside this checkout"; \
  } while (false)

}  // namespace tunnelrig::test
