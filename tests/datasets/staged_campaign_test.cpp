// A campaign that replaces another, on a disk that fails.
#include "datasets/campaign_file.h"
#include "datasets/error.h"
#include "support/temporary_folder.h"

#include <atomic>
#include <cerrno>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

std::atomic<bool> files_fail{false}, folders_fail{false};

}  // namespace

/// In place of the C library's, which nothing on a sound machine makes fail.
extern "C" int fsync(int fd) {
  struct stat of {};
  if (::fstat(fd, &of) == 0 && (S_ISDIR(of.st_mode) ? folders_fail : files_fail)) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_fsync, fd));
}

namespace tunnelrig {
namespace {

using testing::HasSubstr;

struct Staged : testing::Test {
  test::TemporaryFolder folder;

  void SetUp() override { publish("old"); }
  void TearDown() override { files_fail = folders_fail = false; }

  void publish(const char* text) const {
    StagedCampaign staged(folder / "c.db", true);
    staged.file().set_text("notes", text);
    staged.publish();
  }
  std::string text() const {
    return CampaignFile(folder / "c.db", CampaignFile::Access::kRead).text("notes").value_or("");
  }
};

TEST_F(Staged, ReplacesNothingBeforeItIsOnTheDisk) {
  files_fail = true;
  try {
    publish("new");
    FAIL() << "a file that may not be on the disk took the place of one that was";
  } catch (const StorageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("c.db"));
    EXPECT_THAT(error.what(), HasSubstr("Input/output error"));
  }
  files_fail = false;
  EXPECT_EQ(text(), "old");
}

/// Not every file system can; what a crash could then undo is the renaming, after which the old file is
/// whole.
TEST_F(Staged, TheFolderIsSyncedWhereThatCanBe) {
  folders_fail = true;
  publish("new");
  EXPECT_EQ(text(), "new");
}

}  // namespace
}  // namespace tunnelrig
