#include "datasets/campaign_file.h"

#include "datasets/error.h"
#include "datasets/sqlite.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <fstream>
#include <iostream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::ElementsAre;
using testing::HasSubstr;
using Access = CampaignFile::Access;

TEST(CampaignFile, IsDurable) {
  const test::TemporaryFolder folder;
  const CampaignFile file(folder / "c.db", Access::kRecord);
  EXPECT_EQ(file.database().scalar("PRAGMA journal_mode"), "wal");
  EXPECT_EQ(file.database().scalar_integer("PRAGMA synchronous"), 2);  // FULL
  EXPECT_EQ(file.integrity_problems(), "");
  EXPECT_TRUE(file.empty());
}

TEST(CampaignFile, SheetsKeepTextAndGrowColumns) {
  const test::TemporaryFolder folder;
  CampaignFile file(folder / "c.db", Access::kRecord);
  file.set_sheet("runs", parse_csv("run,x\nR1, 1.50\n", "runs.csv"));
  file.append_row("runs", {{"run", "R2"}, {"note", "a \"b\""}});
  const Sheet sheet = file.sheet("runs").value();
  EXPECT_THAT(sheet.columns, ElementsAre("run", "x", "note"));
  EXPECT_THAT(sheet.rows[0].cells, ElementsAre("R1", " 1.50", ""));
  EXPECT_THAT(sheet.rows[1].cells, ElementsAre("R2", "", "a \"b\""));
  EXPECT_FALSE(file.sheet("calibration").has_value());
}

TEST(CampaignFile, SecondRecorderIsRefusedByName) {
  const test::TemporaryFolder folder;
  const CampaignFile file(folder / "c.db", Access::kRecord);
  const pid_t child = ::fork();
  if (child == 0) {
    const std::string said = message_of([&] { CampaignFile second(folder / "c.db", Access::kRecord); });
    const bool right = said.find("is being recorded to by process") != std::string::npos &&
                       said.find(std::to_string(::getppid())) != std::string::npos;
    ::_exit(right ? 0 : 1);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_NO_THROW(CampaignFile(folder / "c.db", Access::kWrite))
      << "short writers may work beside a recorder";
}

TEST(CampaignFile, LockGoesWithItsOwner) {
  const test::TemporaryFolder folder;
  { const CampaignFile file(folder / "c.db", Access::kRecord); }
  EXPECT_FALSE(std::filesystem::exists(folder / "c.db.lock"));
  EXPECT_NO_THROW(CampaignFile(folder / "c.db", Access::kRecord));
}

TEST(CampaignFile, IsOneFileAgainWhenItsLastReaderIsDone) {
  const test::TemporaryFolder folder;
  {
    CampaignFile file(folder / "c.db", Access::kRecord);
    file.set_text("campaign.toml", reference_campaign_toml());
  }
  {
    const CampaignFile reader(folder / "c.db", Access::kRead);
    CampaignFile(folder / "c.db", Access::kWrite).add_document("reduction", {"", "", "{}"}, "{}");
    EXPECT_THROW(const_cast<CampaignFile&>(reader).set_text("x", "y"), StorageError)
        << "a reader cannot write";
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "c.db-wal"));
  EXPECT_TRUE(CampaignFile(folder / "c.db", Access::kRead).newest_document("reduction").has_value());
}

TEST(CampaignFile, RefusesWhatIsNoCampaign) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "text.db") << std::string(2000, 'x');
  EXPECT_THAT(message_of([&] { CampaignFile(folder / "text.db", Access::kRead); }),
              HasSubstr("is no campaign file"));
  EXPECT_THAT(message_of([&] { CampaignFile(folder / "none.db", Access::kRead); }),
              HasSubstr("there is no such campaign file"));
  for (const auto access :
       {CampaignFile::Access::kRead, CampaignFile::Access::kWrite, CampaignFile::Access::kRecord})
    EXPECT_THAT(message_of([&] { CampaignFile(folder.path(), access); }), HasSubstr("is a folder"));
  Database((folder / "other.db").string(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE)
      .execute("CREATE TABLE t (x)");
  EXPECT_THAT(message_of([&] { CampaignFile(folder / "other.db", Access::kWrite); }),
              HasSubstr("but no campaign file"));
  {
    const CampaignFile file(folder / "new.db", Access::kRecord);
    file.database().execute("PRAGMA user_version = 99");
  }
  EXPECT_THAT(message_of([&] { CampaignFile(folder / "new.db", Access::kRead); }),
              HasSubstr("schema version 99"));
}

/// As a user without rights, who may be the one that runs the test: says on stderr what opening gives.
[[noreturn]] void read_without_rights(const std::filesystem::path& path) {
  constexpr uid_t kNobody = 65534;
  if (::geteuid() == 0 && ::setuid(kNobody) != 0) std::_Exit(9);
  std::cerr << message_of([&] { CampaignFile(path, Access::kRead).info(); }) << '\n';
  std::_Exit(0);
}

TEST(CampaignFile, InAReadOnlyFolderSaysThatItsJournalCannotBeRead) {
  const test::TemporaryFolder folder;
  const auto killed = folder / "killed", whole = folder / "whole";
  for (const auto& copy : {killed, whole}) std::filesystem::create_directory(copy);
  {
    CampaignFile file(folder / "c.db", Access::kRecord);
    file.set_text("campaign.toml", reference_campaign_toml());
    std::filesystem::copy(folder / "c.db", killed / "c.db");
    std::filesystem::copy(folder / "c.db-wal", killed / "c.db-wal");
  }
  std::filesystem::copy(folder / "c.db", whole / "c.db");
  using std::filesystem::perms;
  std::filesystem::permissions(folder.path(), perms{0755});
  for (const auto& copy : {killed, whole}) std::filesystem::permissions(copy, perms{0555});
  const testing::ExitedWithCode well(0);
  EXPECT_EXIT(
      read_without_rights(killed / "c.db"), well,
      "c.db: its newest rows are in c.db-wal still, which cannot be read in a folder that is read-only");
  EXPECT_EXIT(read_without_rights(whole / "c.db"), well, "no InputError was thrown");
  for (const auto& copy : {killed, whole}) std::filesystem::permissions(copy, perms::owner_all);
}

TEST(CampaignFile, MigratesFromOlderVersionsWithoutLosingRows) {
  const test::TemporaryFolder folder;
  const std::string first = "-- @version 1\nCREATE TABLE t (x); INSERT INTO t VALUES (7);\n";
  const std::string second = first + "-- @version 2\nALTER TABLE t ADD COLUMN y DEFAULT 3;\n";
  Database database((folder / "m.db").string(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  migrate(database, first);
  EXPECT_EQ(database.scalar_integer("PRAGMA user_version"), 1);
  migrate(database, second);
  migrate(database, second);
  EXPECT_EQ(database.scalar_integer("PRAGMA user_version"), 2);
  EXPECT_EQ(database.scalar_integer("SELECT x + y FROM t"), 10);
  EXPECT_THROW(migrate(database, second + "-- @version 3\nCREATE TABLE u (z); NONSENSE;\n"), StorageError);
  EXPECT_EQ(database.scalar_integer("PRAGMA user_version"), 2) << "a migration that fails changes nothing";
  EXPECT_EQ(database.scalar_integer("SELECT count(*) FROM sqlite_schema WHERE name = 'u'"), 0);
}

TEST(CampaignFile, TransactionIsAllOrNothing) {
  const test::TemporaryFolder folder;
  CampaignFile file(folder / "c.db", Access::kRecord);
  EXPECT_THROW(file.atomically([&] {
    file.set_text("campaign.toml", "x");
    throw InputError("no");
  }),
               InputError);
  EXPECT_TRUE(file.empty());
}

TEST(CampaignFile, SweepsUpKilledImportsAndNothingElse) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> users = {"c.db.notes.part", "c.db..part",       "c.db.12a.part",
                                          "c.db.part",       "c.db.12.part.old", "d.db.12.part"};
  for (const std::string& name : users) std::ofstream(folder / name) << name;
  std::ofstream(folder / "c.db.4711.part") << "half a campaign";
  { const StagedCampaign staged(folder / "c.db", false); }
  EXPECT_FALSE(std::filesystem::exists(folder / "c.db.4711.part"));
  for (const std::string& name : users) EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
}

TEST(CampaignFile, NewestDocumentIsInForce) {
  const test::TemporaryFolder folder;
  CampaignFile file(folder / "c.db", Access::kRecord);
  EXPECT_FALSE(file.newest_document("calibration").has_value());
  file.add_document("calibration", {"0.1", "calibrate", "{}"}, "{\"n\":1}");
  file.add_document("calibration", {"0.2", "calibrate", "{\"points\":\"abc\"}"}, "{\"n\":2}");
  const Document newest = file.newest_document("calibration").value();
  EXPECT_EQ(newest.json, "{\"n\":2}");
  EXPECT_EQ(newest.provenance.program_version, "0.2");
  EXPECT_EQ(file.documents("calibration").size(), 2u);
  EXPECT_THROW(file.add_document("x", {"", "", "no json"}, "{}"), StorageError);
}

}  // namespace
}  // namespace tunnelrig
