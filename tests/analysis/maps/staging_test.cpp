#include "analysis/maps/staging.h"

#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <filesystem>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;

TEST(Staging, WhatAKilledProgramLeftGoesAndWhatIsAtWorkStays) {
  const test::TemporaryFolder folder;
  fs::create_directories(folder / ".tunnelrig-scratch-killed/half");
  fs::permissions(folder / ".tunnelrig-scratch-killed", fs::perms::owner_all);
  fs::create_directories(folder / ".tunnelrig-scratch-of-mine");
  fs::create_directories(folder / ".tunnelrig-scratch-public");
  fs::create_directories(folder / "kept");
  fs::create_directory_symlink(folder / "kept", folder / ".tunnelrig-scratch-linked");
  const Staging at_work(folder.path(), "maps");
  write_text(at_work.path() / "a", "1");
  {
    const Staging next(folder.path(), "maps");
    EXPECT_NE(next.path(), at_work.path());
  }
  EXPECT_FALSE(fs::exists(folder / ".tunnelrig-scratch-killed"));
  EXPECT_TRUE(fs::exists(folder / ".tunnelrig-scratch-of-mine")) << "no name that this program gives";
  EXPECT_TRUE(fs::exists(folder / ".tunnelrig-scratch-public")) << "nor permissions";
  EXPECT_TRUE(fs::is_symlink(folder / ".tunnelrig-scratch-linked"));
  EXPECT_EQ(at_work.publish({"a"}).size(), 1u);
  EXPECT_EQ(read_text(folder / "a"), "1");
}

}  // namespace
}  // namespace tunnelrig
