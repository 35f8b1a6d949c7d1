#include "datasets/campaign_folder.h"

#include "analysis/run_summary.h"
#include "datasets/error.h"
#include "datasets/raw_store.h"
#include "datasets/sqlite.h"
#include "datasets/statistics_store.h"
#include "support/example_campaign.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;
using test::message_of;
using testing::HasSubstr;

ImportOptions options() {
  ImportOptions options;
  options.summarizer = [](const CampaignInfo& info, const RawFormat& format) {
    return make_run_summarizer(info, format);
  };
  return options;
}

/// Every file of a folder: relative path and bytes.
std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = read_text(entry.path());
  }
  return files;
}

void replace(std::string& text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
}

struct Folder : testing::Test {
  test::TemporaryFolder folder;
  test::ExampleCampaign campaign;
  fs::path source = folder / "source", db = folder / "c.db";

  /// What the import says of the campaign as it now is; nothing of it may be stored.
  std::string refusal() {
    fs::remove_all(source);
    campaign.write(source);
    return import_refusal();
  }
  std::string import_refusal() {
    std::string said = message_of([&] { import_campaign_folder(source, db, options()); });
    EXPECT_FALSE(fs::exists(db)) << "something was stored of a campaign that was refused";
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1)
        << "files were left behind";
    return said;
  }
};

TEST_F(Folder, ExportGivesBackEveryByte) {
  campaign.runs_csv =
      "run,location,operator,repeat,session,start_utc,raw,y_norm,z_norm,air_temperature_C,fan_rpm\n"
      "R1,OT,\"Kim, \"\"K\"\"\",01,S1,2026-03-02T08:00:00Z,raw/R1.npy,0,0, 20.50,\n"
      "R2,H4V-2,,1,S1,2026-03-02T08:05:00.000Z,raw/R2.npy,0.80,-0.64,20.7,1e3\n"
      "R3,OS,Åse,1,S2,2026-03-03T08:00:00Z,raw/R3.npy,,,18,7\n";
  campaign.write(source);
  write_text(source / "raw/R2.gaps.csv",
             "first_frame,frames_lost,cause,estimated\n10,3,lost,0\n10,500,reboot,1\n400,2,,0\n");
  const RawFormat floats{SampleType::kFloat64, 4};
  test::write_npy(source / "raw/R3.npy", floats, 400, test::example_frames(400, 9, floats));
  import_campaign_folder(source, db, options());
  const CampaignFile file(db, CampaignFile::Access::kRead);
  export_campaign_folder(file, folder / "out", {});
  EXPECT_EQ(contents(folder / "out"), contents(source));
}

TEST_F(Folder, ARunThatIsBeingRecordedIsNamedAndExcluded) {
  campaign.write(source);
  import_campaign_folder(source, db, options());
  const CampaignFile file(db, CampaignFile::Access::kWrite);
  EXPECT_THAT(export_campaign_folder(file, folder / "whole", {}), testing::IsEmpty());
  file.database().execute("UPDATE raw_runs SET state = 'recording', hash = '' WHERE run = 'R2'");
  EXPECT_THAT(export_campaign_folder(file, folder / "out", {}), testing::ElementsAre("R2"));
  EXPECT_THAT(read_text(folder / "out/runs.csv"), testing::HasSubstr("its recording is partial"));
  EXPECT_EQ(read_text(folder / "out/raw/R2.npy"), read_text(source / "raw/R2.npy"));
}

TEST_F(Folder, GapsComeBackWithTheColumnsThatTheyHad) {
  for (const char* gaps :
       {"first_frame,frames_lost\n10,3\n400,2\n", "first_frame,frames_lost,cause\n10,3,lost\n400,2,\n",
        "first_frame,frames_lost,estimated\n10,3,0\n400,2,1\n"}) {
    campaign.write(source);
    write_text(source / "raw/R2.gaps.csv", gaps);
    import_campaign_folder(source, db, options());
    const fs::path out = folder / "out", again = folder / "again.db";
    export_campaign_folder(CampaignFile(db, CampaignFile::Access::kRead), out, {});
    EXPECT_EQ(read_text(out / "raw/R2.gaps.csv"), gaps);
    import_campaign_folder(out, again, options());
    fs::remove_all(out);
    export_campaign_folder(CampaignFile(again, CampaignFile::Access::kRead), out, {});
    EXPECT_EQ(contents(out), contents(source));
    for (const fs::path& path : {source, db, out, again}) fs::remove_all(path);
  }
}

TEST_F(Folder, VoltsThatAreNoneAreRefused) {
  const RawFormat floats{SampleType::kFloat64, 4};
  for (const auto& [value, why] :
       {std::pair(1e100, "is 1e+100; every voltage must be at most 1e12 V, either way"),
        {-2e12, "is -2e+12; every voltage must be at most 1e12 V, either way"},
        {std::nan(""), "is nan; every voltage must be a finite number"}}) {
    fs::remove_all(source);
    campaign.write(source);
    auto frames = test::example_frames(400, 9, floats);
    std::memcpy(frames.data() + 42 * sizeof(double), &value, sizeof(double));
    test::write_npy(source / "raw/R2.npy", floats, 400, frames);
    EXPECT_EQ(import_refusal(), std::string("raw/R2.npy: frame 10, channel 3 ") + why);
  }
}

TEST_F(Folder, LostFramesHaveALimit) {
  campaign.write(source);
  write_text(source / "raw/R2.gaps.csv", "first_frame,frames_lost\n10,1e30\n");
  EXPECT_THAT(import_refusal(), testing::HasSubstr("1e+30 is no whole number of frames, 1 to 1e15"));
}

TEST_F(Folder, GapsOfNoArrayAreSaid) {
  campaign.write(source);
  write_text(source / "raw/R2.npy.gaps.csv", "first_frame,frames_lost\n10,3\n");
  EXPECT_THAT(import_campaign_folder(source, db, options()).doubts,
              testing::ElementsAre(
                  "raw/R2.npy.gaps.csv: not read, since no run has an array of that name beside it"));
}

class FolderTypes : public Folder, public testing::WithParamInterface<SampleType> {};

TEST_P(FolderTypes, ArraysKeepTypeAndValues) {
  campaign.write(source);
  const RawFormat format{GetParam(), 4};
  test::write_npy(source / "raw/R1.npy", format, 777, test::example_frames(777, 5, format));
  import_campaign_folder(source, db, options());
  export_campaign_folder(CampaignFile(db, CampaignFile::Access::kRead), folder / "out", {});
  EXPECT_EQ(read_text(folder / "out/raw/R1.npy"), read_text(source / "raw/R1.npy"));
}

INSTANTIATE_TEST_SUITE_P(All, FolderTypes,
                         testing::Values(SampleType::kInt16, SampleType::kUInt16, SampleType::kFloat32,
                                         SampleType::kFloat64),
                         [](const auto& type) { return std::string(name_of(type.param)); });

TEST_F(Folder, MillivoltsAreDoubted) {
  const RawFormat format{SampleType::kFloat64, 4};
  auto frames = test::example_frames(400, 1, format);
  campaign.write(source);
  test::write_npy(source / "raw/R2.npy", format, 400, frames);
  EXPECT_THAT(import_campaign_folder(source, db, options()).doubts, testing::IsEmpty());
  for (std::size_t at = 0; at < frames.size(); at += sizeof(double)) {
    double value = 0;
    std::memcpy(&value, frames.data() + at, sizeof(value));
    value *= 1000;
    std::memcpy(frames.data() + at, &value, sizeof(value));
  }
  for (const char* raw : {"raw/R1.npy", "raw/R2.npy", "raw/R3.npy"})
    test::write_npy(source / raw, format, 400, frames);
  EXPECT_THAT(import_campaign_folder(source, folder / "mV.db", options()).doubts,
              testing::ElementsAre(testing::AllOf(
                  HasSubstr("runs.csv:2: run R1: channel 1 of raw/R1.npy holds 2"), HasSubstr("in 3 runs"))))
      << "and the calibration is not blamed for what they become";
}

TEST_F(Folder, StatisticsAreStoredWithTheHashOfTheirData) {
  campaign.write(source, 4000);
  const ImportSummary summary = import_campaign_folder(source, db, options());
  EXPECT_EQ(summary.runs, 3u);
  EXPECT_EQ(summary.frames, 12000u);
  const CampaignFile file(db, CampaignFile::Access::kRead);
  const RawRun run = raw_run(file, "R2").value();
  const auto statistics = all_statistics(file);
  EXPECT_EQ(statistics.at(run.id).hash, run.hash);
  EXPECT_EQ(statistics.at(run.id).frames, 4000u);
  EXPECT_NEAR(statistics.at(run.id).channels[0].mean_V, 2600 * 3.3 / 4096, 0.002);
}

TEST_F(Folder, OneCampaignPerFile) {
  campaign.write(source);
  import_campaign_folder(source, db, options());
  EXPECT_THAT(message_of([&] { import_campaign_folder(source, db, options()); }),
              HasSubstr("already holds a campaign"));
  ImportOptions replacing = options();
  replacing.replace = true;
  EXPECT_NO_THROW(import_campaign_folder(source, db, replacing));
  EXPECT_EQ(CampaignFile(db, CampaignFile::Access::kRead).integrity_problems(), "");
}

TEST_F(Folder, WhatAKilledImportLeftIsSweptUp) {
  campaign.write(source);
  write_text(folder / "c.db.99999.part", "half a campaign");
  import_campaign_folder(source, db, options());
  EXPECT_FALSE(fs::exists(folder / "c.db.99999.part"));
}

TEST_F(Folder, AFailedReplacementLeavesTheOldCampaign) {
  campaign.write(source);
  import_campaign_folder(source, db, options());
  fs::remove(source / "raw/R3.npy");
  ImportOptions replacing = options();
  replacing.replace = true;
  EXPECT_THAT(message_of([&] { import_campaign_folder(source, db, replacing); }),
              HasSubstr("the raw file raw/R3.npy is missing"));
  EXPECT_EQ(CampaignFile(db, CampaignFile::Access::kRead).runs().size(), 3u);
}

TEST_F(Folder, RefusesBadFolders) {
  EXPECT_THAT(message_of([&] { import_campaign_folder(source, db, options()); }),
              HasSubstr("there is no such campaign folder"));
  campaign.write(source);
  fs::remove(source / "calibration.csv");
  EXPECT_THAT(import_refusal(), HasSubstr("the file calibration.csv is missing"));
  fs::remove(source / "campaign.toml");
  EXPECT_THAT(import_refusal(), HasSubstr("the file campaign.toml is missing"));
}

TEST_F(Folder, RefusesBadRuns) {
  replace(campaign.runs_csv, "raw/R2.npy", "../R2.npy");
  EXPECT_THAT(refusal(), HasSubstr("runs.csv:3: column raw: '../R2.npy' must be a path inside"));
  campaign = {};
  replace(campaign.runs_csv, "20.7", "-300");
  EXPECT_THAT(refusal(), HasSubstr("runs.csv:3: column air_temperature_C: -300"));
  campaign = {};
  replace(campaign.calibration_csv, "2,1,", "7,1,");
  EXPECT_THAT(refusal(), HasSubstr("calibration.csv:12: column cell: '7' is not a whole number from 1 to 4"));
  campaign = {};
  replace(campaign.propellers_csv, "CCW,7.45", "left,7.45");
  EXPECT_THAT(refusal(), HasSubstr("propellers.csv:4: column direction: 'left' is neither CW nor CCW"));
}

TEST_F(Folder, RefusesBadRawData) {
  campaign.write(source);
  test::write_npy(source / "raw/R2.npy", {}, 0, {});
  EXPECT_THAT(import_refusal(), HasSubstr("runs.csv:3: run R2: raw/R2.npy holds zero frames"));

  const RawFormat floats{SampleType::kFloat32, 4};
  auto data = test::example_frames(50, 1, floats);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(data.data() + 30 * 16 + 8, &nan, sizeof nan);
  test::write_npy(source / "raw/R2.npy", floats, 50, data);
  EXPECT_THAT(import_refusal(), HasSubstr("raw/R2.npy: frame 30, channel 3 is nan"));

  auto stuck = test::example_frames(50, 1);
  const std::int16_t same = 2048;
  for (std::size_t i = 0; i < 50; ++i) std::memcpy(stuck.data() + i * 8 + 6, &same, 2);
  test::write_npy(source / "raw/R2.npy", {}, 50, stuck);
  EXPECT_THAT(import_refusal(), HasSubstr("runs.csv:3: run R2: channel 4 of raw/R2.npy is stuck at 1.65 V"));

  auto beyond = test::example_frames(50, 1);
  const std::int16_t large = 4096;
  std::memcpy(beyond.data(), &large, 2);
  test::write_npy(source / "raw/R2.npy", {}, 50, beyond);
  EXPECT_THAT(import_refusal(), HasSubstr("leaves the converter's range of 12 bits"));

  test::write_npy(source / "raw/R2.npy", {}, 50, test::example_frames(50, 1));
  write_text(source / "raw/R2.gaps.csv", "first_frame,frames_lost\n51,3\n");
  EXPECT_THAT(import_refusal(),
              HasSubstr("R2.gaps.csv:2: column first_frame: 51 is no frame index from 0 to 50"));
  write_text(source / "raw/R2.gaps.csv", "first_frame,frames_lost,estimated\n50,3,true\n");
  EXPECT_THAT(message_of([&] { import_campaign_folder(source, db, options()); }),
              HasSubstr("R2.gaps.csv:2: column estimated: 'true' is neither 0 nor 1"));
}

TEST_F(Folder, TakesAStuckChannelWhenAsked) {
  campaign.write(source);
  auto stuck = test::example_frames(50, 1);
  for (std::size_t i = 0; i < 50; ++i) std::memset(stuck.data() + i * 8 + 6, 4, 2);
  test::write_npy(source / "raw/R2.npy", {}, 50, stuck);
  ImportOptions lenient = options();
  lenient.allow_stuck = true;
  EXPECT_NO_THROW(import_campaign_folder(source, db, lenient));
}

TEST_F(Folder, TakesRunsWithThrustsInTheRow) {
  campaign.runs_csv =
      "run,location,repeat,session,start_utc,raw,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N\n"
      "R1,OT,1,S1,2026-03-02T08:00:00Z,,7.1,7.2,7.3,7.4\n";
  campaign.write(source);
  import_campaign_folder(source, db, options());
  const auto runs = CampaignFile(db, CampaignFile::Access::kRead).runs();
  EXPECT_EQ(runs[0].thrust_N[3], 7.4);
}

TEST_F(Folder, ExportNeverOverwrites) {
  campaign.write(source);
  import_campaign_folder(source, db, options());
  const CampaignFile file(db, CampaignFile::Access::kRead);
  EXPECT_THAT(message_of([&] { export_campaign_folder(file, source, {}); }),
              HasSubstr("is not an empty folder"));
  fs::create_directory(folder / "empty");
  EXPECT_NO_THROW(export_campaign_folder(file, folder / "empty", {}));
}

/// Files of before had such rows: a logged run R0002 beside an imported one whose raw file is raw/R0002.npy.
TEST_F(Folder, ExportKeepsTwoRecordingsOfOnePathApart) {
  campaign.write(source);
  import_campaign_folder(source, db, options());
  {
    CampaignFile file(db, CampaignFile::Access::kWrite);
    file.set_cell("runs", "run", "R3", "raw", "raw/R1.npy");
  }
  const CampaignFile file(db, CampaignFile::Access::kRead);
  export_campaign_folder(file, folder / "out", {});
  fs::remove(db);
  import_campaign_folder(folder / "out", db, options());
  const CampaignFile again(db, CampaignFile::Access::kRead);
  for (const char* run : {"R1", "R2", "R3"})
    EXPECT_EQ(raw_run(again, run)->hash, raw_run(file, run)->hash) << run;
  EXPECT_EQ(again.runs()[0].raw, "raw/R1.npy");
  EXPECT_EQ(again.runs()[2].raw, "raw/R1-2.npy");
}

/// An import calls every recording complete.
TEST_F(Folder, APartialRecordingLeavesAsExcluded) {
  campaign.write(source);
  import_campaign_folder(source, db, options());
  {
    CampaignFile file(db, CampaignFile::Access::kRecord);
    for (const std::string name : {"P1", "P2"}) {
      file.append_row("runs", {{"run", name},
                               {"location", "OT"},
                               {"repeat", "9"},
                               {"session", "S1"},
                               {"start_utc", "2026-03-02T12:00:00Z"},
                               {"raw", "raw/" + name + ".npy"},
                               {"excluded", name == "P2" ? "a gust" : ""}});
      RawWriter writer(file, name, {}, 133);
      writer.frames(test::example_frames(100, 3));
      writer.finish(RunState::kPartial, {});
    }
  }
  export_campaign_folder(CampaignFile(db, CampaignFile::Access::kRead), folder / "out", {});
  import_campaign_folder(folder / "out", folder / "again.db", options());
  const auto runs = CampaignFile(folder / "again.db", CampaignFile::Access::kRead).runs();
  std::map<std::string, std::string> excluded;
  for (const tunnelrig::Run& run : runs)
    if (!run.excluded.empty()) excluded[run.run] = run.excluded;
  EXPECT_THAT(excluded, testing::UnorderedElementsAre(std::pair("P1", "its recording is partial"),
                                                      std::pair("P2", "a gust")));
}

TEST(SharedExample, RoundTrip) {
  SKIP_WITHOUT_SHARED_DATA();
  const test::TemporaryFolder folder;
  const fs::path source = test::shared_data() / "example_campaign";
  import_campaign_folder(source, folder / "c.db", options());
  export_campaign_folder(CampaignFile(folder / "c.db", CampaignFile::Access::kRead), folder / "out", {});
  EXPECT_EQ(contents(folder / "out"), contents(source));
}

}  // namespace
}  // namespace tunnelrig
