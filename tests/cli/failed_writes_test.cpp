// Writes that fail, by a limit of file sizes that stands for a full disk: a message that names what the user
// asked for, an exit code, nothing left behind.
#include "cli/program.h"
#include "datasets/csv.h"
#include "datasets/raw_store.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/prctl.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;
using test::ProgramResult;
using testing::AnyOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

// In blocks of 512 bytes. Reading a campaign file takes 32 kB beside it, which SQLite shares between
// processes.
constexpr const char* kLittleRoom = "ulimit -f 128";

struct FailedWrites : testing::Test {
  test::TemporaryFolder folder;

  std::vector<std::string> left() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder.path()))
      names.push_back(entry.path().filename().string());
    return names;
  }
};

TEST_F(FailedWrites, OfAnImport) {
  test::ExampleCampaign().write(folder / "source", 20000);
  const ProgramResult result = test::run_program(folder.path(), "import source --db c.db", kLittleRoom);
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, HasSubstr("disk I/O error: is the disk full"));
  EXPECT_THAT(left(), testing::ElementsAre("source"));
}

TEST_F(FailedWrites, OfARecordingSayWhatIsKept) {
  const auto log = [&](const char* room) {
    return test::run_program(folder.path(),
                             "log --db c.db --location OT --session S1 --duration 1000 --speed max", room);
  };
  for (const char* room : {"ulimit -f 100", "ulimit -f 400", "ulimit -f 900"}) {  // the schema, the first row
    const ProgramResult result = log(room);
    EXPECT_EQ(result.code, 2) << room;
    EXPECT_THAT(result.error, HasSubstr("Nothing was recorded, and there is no c.db.")) << room;
    EXPECT_THAT(left(), testing::IsEmpty()) << room;
  }
  ASSERT_EQ(test::run_program(folder.path(), "log --db c.db --location OT --session S1 --duration 1").code,
            0);
  const ProgramResult result = log("ulimit -f 9000");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, HasSubstr("The run ends here as partial; everything before it is safe."));
}

TEST_F(FailedWrites, ACampaignFileThatCannotBeOpenedForLackOfRoomIsNotCalledDamaged) {
  test::ExampleCampaign().write(folder / "source");
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  const ProgramResult result = test::run_program(folder.path(), "reduce --db c.db", "ulimit -f 20");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, HasSubstr("c.db: disk I/O error: is the disk full"));
}

TEST_F(FailedWrites, OfAnExportNameTheTarget) {
  test::ExampleCampaign().write(folder / "source", 20000);
  ASSERT_EQ(test::run_program(folder.path(), "import source --db c.db").code, 0);
  for (const std::string format : {"folder", "hdf5", "mat", "csv", "npy"}) {
    for (const auto& [target, before] :
         {std::pair<const char*, const char*>{"out", kLittleRoom}, {"/proc/out", "true"}}) {
      const ProgramResult result =
          test::run_program(folder.path(), "export --db c.db --format " + format + " " + target, before);
      EXPECT_EQ(result.code, 2) << format << "\n" << result.error;
      EXPECT_THAT(result.error, AnyOf(HasSubstr(fmt::format(" {}: cannot be written", target)),
                                      HasSubstr(fmt::format(" {}/raw/R1", target))));
      EXPECT_THAT(result.error, Not(HasSubstr(".part"))) << format;
    }
    EXPECT_THAT(left(), testing::UnorderedElementsAre("source", "c.db")) << format;
  }
  const ProgramResult above =
      test::run_program(folder.path(), "export --db c.db --format csv a/b/out", kLittleRoom);
  EXPECT_EQ(above.code, 2);
  EXPECT_FALSE(fs::exists(folder / "a"));
}

/// A recording's log may lie on the disk that is full, or go to a terminal that is gone.
TEST_F(FailedWrites, OfWhatIsSaidEndNothing) {
  const auto code_of = [&](const std::string& arguments) {
    const int status = std::system(  // NOLINT(concurrency-mt-unsafe)
        fmt::format("cd '{}' && '{}' {}", folder.path().string(), TUNNELRIG_PROGRAM, arguments).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  for (const std::string where : {"/dev/full", "&-"}) {
    EXPECT_EQ(code_of("plan --repeats 1 2>" + where), 2) << where;
    EXPECT_EQ(code_of("log --db c.db --location OT --session S1 --duration 2.5 >/dev/null 2>" + where), 0)
        << "2.5 s are long enough for a line of progress: " << where;
    EXPECT_EQ(
        code_of("log --db c.db --location OT --session S1 --duration 1 --speed max 2>/dev/null >" + where), 2)
        << "the recording is whole, what was to be said of it is not";
    EXPECT_EQ(code_of("--help 2>/dev/null >" + where), 2);
  }
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  for (const RawRun& run : raw_runs(file)) EXPECT_EQ(run.state, RunState::kComplete);
}

TEST_F(FailedWrites, OfAFlightLeaveNoEmptyFolder) {
  write_text(folder / "short.toml",
             "format = \"tunnelrig-scenario/1\"\nname = \"short\"\n[[segments]]\nkind = \"circle\"\n"
             "centre = [0, 0.65]\nradius_m = 0.1\nrate_rad_s = 1.5\nturns = 0.1\n");
  const ProgramResult result =
      test::run_program(folder.path(), "fly --scenario short.toml --runs 1 --out a/b", "ulimit -f 1");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, EndsWith("a/b/comparison.csv: cannot be written: File too large\n"));
  EXPECT_THAT(left(), testing::ElementsAre("short.toml"));
}

/// The comparison fits, the log does not.
TEST_F(FailedWrites, OfAFlightLeaveNothingHalfWritten) {
  write_text(folder / "short.toml",
             "format = \"tunnelrig-scenario/1\"\nname = \"short\"\n[[segments]]\nkind = \"circle\"\n"
             "centre = [0, 0.65]\nradius_m = 0.1\nrate_rad_s = 1.5\nturns = 0.5\n");
  const ProgramResult result = test::run_program(
      folder.path(), "fly --scenario short.toml --controllers ibs --runs 1 --out a", "ulimit -f 4");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, EndsWith("a/ibs.csv: cannot be written: File too large\n"));
  EXPECT_THAT(left(), testing::ElementsAre("short.toml"));
}

bool says(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

/// As a user whom the rights of files bind, be it root: 0 where all is as it should be, else what to look
/// for.
int derive_read_only(const fs::path& place) {
  ::prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0);  // refused to whoever does not have it anyway
  const ProgramResult reduced =
      test::run_program(place, "reduce --db kept/c.db --csv a.csv --runs-csv b.csv --json");
  const ProgramResult anew = test::run_program(place, "reduce --db kept/c.db --from-raw");
  const ProgramResult mapped = test::run_program(place, "map --db kept/c.db --out maps");
  if (reduced.code != 0 || anew.code != 0 || mapped.code != 0) return 1;
  if (!says(reduced.error, "kept/c.db: cannot be written, so this reduction is not stored in it")) return 2;
  if (!reduced.out.starts_with("{") || !fs::exists(place / "a.csv") || !fs::exists(place / "b.csv")) return 3;
  if (!says(mapped.error, "kept/c.db: cannot be written, so this map is not stored in it")) return 4;
  return says(mapped.out, "change of C_T against OT") && fs::exists(place / "maps") ? 0 : 5;
}

TEST_F(FailedWrites, AFileThatCannotBeWrittenIsReducedAndMappedAllTheSame) {
  const auto run = [&](const std::string& arguments) {
    return test::run_program(folder.path(), arguments).code;
  };
  fs::create_directory(folder / "kept");
  ASSERT_EQ(run("plan --out p.csv --tunnel-only --repeats 2 --duration 1"), 0);
  ASSERT_EQ(run("log --db kept/c.db --plan p.csv --speed max"), 0);
  ASSERT_EQ(run("calibrate --db kept/c.db"), 0);
  fs::permissions(folder / "kept/c.db", fs::perms{0444});
  fs::permissions(folder / "kept", fs::perms{0555});
  EXPECT_EXIT(std::_Exit(derive_read_only(folder.path())), testing::ExitedWithCode(0), "");
  fs::permissions(folder / "kept", fs::perms::owner_all);
  EXPECT_TRUE(CampaignFile(folder / "kept/c.db", CampaignFile::Access::kRead).documents("map").empty());
}

TEST_F(FailedWrites, OfAReductionAreSeenBeforeOneGoesOverTheOther) {
  const ProgramResult result =
      test::run_program(folder.path(), "reduce --db c.db --csv a.csv --runs-csv ./a.csv");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.error, HasSubstr("--runs-csv ./a.csv: the same place as --csv a.csv"));
}

TEST_F(FailedWrites, OfAnExplanationAreSeenBeforeTheSearch) {
  write_text(folder / "a.json", "kept");
  for (const auto& [options, why] :
       {std::pair("--json none/e.json", "none/e.json: cannot be written: there is no folder none"),
        {"--html none/e.html", "none/e.html: cannot be written: there is no folder none"},
        {"--json a.json --html ./a.json", "--html ./a.json: the same place as --json a.json"}}) {
    const ProgramResult result =
        test::run_program(folder.path(), fmt::format("explain --db none.db {}", options));
    EXPECT_EQ(result.code, 2) << options;
    EXPECT_THAT(result.error, HasSubstr(why));
  }
  EXPECT_THAT(left(), testing::ElementsAre("a.json"));
}

/// Tuning or flying first would take much longer than this test may.
TEST_F(FailedWrites, OfFlightsAreSeenBeforeAnyIsFlown) {
  fs::create_directory(folder / "a");
  { CampaignFile(folder / "c.db", CampaignFile::Access::kRecord).set_text("table.toml", ""); }
  for (const auto& [options, why] :
       {std::pair("--tune a", "a: cannot be written: it is a folder"),
        {"--json a", "a: cannot be written: it is a folder"},
        {"--tune c.db", "c.db: cannot be written: it is a campaign file"},
        {"--json c.db --runs 100000", "c.db: cannot be written: it is a campaign file"},
        {"--json none/f.json", "there is no folder none"},
        {"--json f --tune ./f", "--tune ./f: the same place as --json f"},
        {"--json f --out f --runs 100000", "--out f: the same place as --json f"},
        {"--gains f --tune f", "--tune f: the same place as --gains f"}}) {
    const ProgramResult result =
        test::run_program(folder.path(), fmt::format("fly {}", options), "ulimit -t 5");
    EXPECT_EQ(result.code, 2) << options;
    EXPECT_EQ(result.out, "") << options;
    EXPECT_THAT(result.error, HasSubstr(why));
  }
}

}  // namespace
}  // namespace tunnelrig
