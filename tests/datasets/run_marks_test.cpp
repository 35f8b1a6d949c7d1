// What is said of a run after it began: kept with it, and never at its expense.
#include "datasets/run_marks.h"

#include "datasets/recorder_lock.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <atomic>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;

struct RunMarks : testing::Test {
  test::TemporaryFolder folder;
  CampaignFile file{folder / "c.db", CampaignFile::Access::kRecord};

  void SetUp() override {
    file.set_text("campaign.toml", reference_campaign_toml());
    for (const char* run : {"R1", "R2"})
      file.append_row("runs", {{"run", run},
                               {"location", "OT"},
                               {"repeat", "1"},
                               {"session", "S1"},
                               {"start_utc", "2026-03-02T08:00:00Z"},
                               {"raw", std::string("raw/") + run + ".npy"}});
  }
};

TEST_F(RunMarks, AddColumnsBesideTheRecorder) {
  CampaignFile desk(folder / "c.db", CampaignFile::Access::kWrite);
  exclude_run(desk, "R2", " a \"draught\", twice\n");
  add_note(desk, "R1", "17");  // a number is a remark all the same, not a covariate
  add_note(desk, "R1", "door open");
  EXPECT_TRUE(mark_alarms(desk, "R1", "clipping;loss"));
  file.atomically([&] { EXPECT_FALSE(mark_alarms(desk, "R1", "")) << "and does not wait"; });
  file.append_row("runs", {{"run", "R3"},
                           {"location", "OT"},
                           {"repeat", "2"},
                           {"session", "S1"},
                           {"start_utc", "2026-03-02T09:00:00Z"},
                           {"raw", "raw/R3.npy"}});
  const auto runs = file.runs();
  ASSERT_EQ(runs.size(), 3u);
  EXPECT_EQ(runs[1].excluded, "a \"draught\", twice");
  EXPECT_EQ(runs[0].note, "17\ndoor open");
  EXPECT_EQ(runs[0].alarms, "clipping;loss");
  EXPECT_EQ(runs[2].excluded + runs[2].note + runs[2].alarms, "");
  EXPECT_TRUE(runs[0].numbers.empty() && runs[0].labels.empty());
}

TEST_F(RunMarks, IncludingKeepsTheReason) {
  exclude_run(file, "R1", "wrong propeller");
  add_note(file, "R1", "second look");
  include_run(file, "R1");
  const auto run = file.runs().at(0);
  EXPECT_EQ(run.excluded, "");
  EXPECT_EQ(run.note, "second look\nwas excluded: wrong propeller");
  EXPECT_THAT(test::message_of([&] { include_run(file, "R1"); }), HasSubstr("R1 is not excluded"));
}

TEST_F(RunMarks, RefuseWhatSaysNothing) {
  EXPECT_THAT(test::message_of([&] { exclude_run(file, "R9", "x"); }), HasSubstr("there is no run R9"));
  EXPECT_THAT(test::message_of([&] { exclude_run(file, "R1", " \t"); }), HasSubstr("for a reason"));
  EXPECT_THAT(test::message_of([&] { add_note(file, "R1", ""); }), HasSubstr("empty note"));
  EXPECT_THAT(test::message_of([&] { mark_alarms(file, "R9", "loss"); }), HasSubstr("there is no run R9"));
  EXPECT_FALSE(file.sheet("runs")->find("excluded"));
}

TEST(OneLine, CutsBetweenCharacters) {
  EXPECT_EQ(one_line(" a\tb\r\nc "), "a b  c");
  const std::string thetas = [] {
    std::string text = "x";
    for (int i = 0; i < 400; ++i) text += "Θ";
    return text;
  }();
  EXPECT_EQ(one_line(thetas), thetas.substr(0, 499));
  EXPECT_EQ(one_line("Θ"), "Θ");
}

TEST_F(RunMarks, TheRecorderIsSeenWithoutBeingHeldUp) {
  ASSERT_TRUE(recorder_of(folder / "c.db"));
  EXPECT_FALSE(recorder_of(folder / "other.db"));
  std::atomic<bool> done{false};
  std::thread looker([&] {
    while (!done) recorder_of(folder / "d.db");
  });
  for (int i = 0; i < 50; ++i) {
    const CampaignFile other(folder / "d.db", CampaignFile::Access::kRecord);
    EXPECT_TRUE(recorder_of(folder / "d.db"));
  }
  done = true;
  looker.join();
}

TEST(CampaignToml, SaysWhatTheLivePageExpects) {
  const std::string text =
      "format = \"tunnelrig-campaign/1\"\n[rig]\npropeller_radius_m = 0.1\nnominal_speed_rpm = 5000\n";
  const CampaignInfo plain = parse_campaign_toml(text, "c.toml");
  EXPECT_EQ(plain.rig.blades, 2);
  EXPECT_EQ(plain.rig.cell_limit_N, 9.81);
  EXPECT_EQ(plain.daq.mains_hz, std::nullopt);
  const CampaignInfo given =
      parse_campaign_toml(text + "blades = 3\ncell_limit_N = 49\n[daq]\nmains_hz = 60\n", "c.toml");
  EXPECT_EQ(given.rig.blades, 3);
  EXPECT_EQ(given.rig.cell_limit_N, 49);
  EXPECT_EQ(given.daq.mains_hz, 60);
  EXPECT_THAT(test::message_of([&] { parse_campaign_toml(text + "blades = 0\n", "c.toml"); }),
              HasSubstr("c.toml:5: rig.blades"));
}

}  // namespace
}  // namespace tunnelrig
