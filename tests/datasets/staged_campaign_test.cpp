// A campaign that replaces another, on a disk that fails.
#include "datasets/campaign_file.h"
#include "datasets/error.h"
#include "datasets/sqlite.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

std::atomic<bool> files_fail{false}, folders_fail{false}, renames_fail{false};

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

extern "C" int rename(const char* from, const char* to) noexcept {
  if (renames_fail) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_rename, from, to));
}

namespace tunnelrig {
namespace {

using testing::HasSubstr;

struct Staged : testing::Test {
  test::TemporaryFolder folder;

  void SetUp() override { publish("old"); }
  void TearDown() override { files_fail = folders_fail = renames_fail = false; }

  void publish(const char* text) const {
    StagedCampaign staged(folder / "c.db", true);
    staged.file().set_text("notes", text);
    staged.publish();
  }
  std::string text() const {
    return CampaignFile(folder / "c.db", CampaignFile::Access::kRead).text("notes").value_or("");
  }
};

/// Who removes a campaign by hand may leave its journal.
TEST_F(Staged, TakesThePlaceOfAFileThatIsGone) {
  std::filesystem::remove(folder / "c.db");
  std::ofstream(folder / "c.db-wal") << "what nobody needs";
  publish("new");
  EXPECT_EQ(text(), "new");
}

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

/// Somebody looks on, so that what is written stays in the journal.
struct StagedBesideAReader : Staged {
  void SetUp() override {
    Staged::SetUp();
    reader.emplace(folder / "c.db", CampaignFile::Access::kRead);
    reader->text("notes");
    CampaignFile(folder / "c.db", CampaignFile::Access::kWrite).set_text("notes", "newest");
  }
  std::optional<CampaignFile> reader;
};

/// As after a kill in the moment before the new file is put in place.
TEST_F(StagedBesideAReader, UntilItIsReplacedTheOldCampaignIsWhole) {
  renames_fail = true;
  EXPECT_THROW(publish("new"), std::filesystem::filesystem_error);
  std::filesystem::create_directory(folder / "copy");  // the reader, who closes last, would mend it
  for (const auto& each : files_of_campaign("c.db"))
    if (std::filesystem::exists(folder / each)) std::filesystem::copy(folder / each, folder / "copy" / each);
  EXPECT_EQ(CampaignFile(folder / "copy" / "c.db", CampaignFile::Access::kRead).text("notes"), "newest");
  reader.reset();
  renames_fail = false;
  publish("new");
  EXPECT_EQ(text(), "new");
}

TEST_F(StagedBesideAReader, OneInTheMidstOfReadingIsNotPulledTheFileFromUnder) {
  reader->database().execute("BEGIN; SELECT count(*) FROM texts");
  CampaignFile(folder / "c.db", CampaignFile::Access::kWrite).set_text("notes", "newer still");
  EXPECT_THAT(test::message_of([&] { publish("new"); }), HasSubstr("is being read by another program"));
  reader.reset();
  EXPECT_EQ(text(), "newer still");
}

}  // namespace
}  // namespace tunnelrig
