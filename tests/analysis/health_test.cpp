#include "analysis/health.h"

#include "analysis/run_summary.h"
#include "datasets/campaign_folder.h"
#include "datasets/sqlite.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;

struct Health : testing::Test {
  test::TemporaryFolder folder;
  test::ExampleCampaign campaign;

  void import(bool allow_stuck = false) {
    campaign.write(folder / "source");
    read(allow_stuck);
  }
  void read(bool allow_stuck = false) {
    ImportOptions options{.replace = true, .allow_stuck = allow_stuck};
    options.summarizer = [](const CampaignInfo& info, const RawFormat& format) {
      return make_run_summarizer(info, format);
    };
    import_campaign_folder(folder / "source", folder / "c.db", options);
  }
  void calibrate_file() const {
    CampaignFile file(folder / "c.db", CampaignFile::Access::kWrite);
    file.add_document("calibration", {"", "", "{}"},
                      to_json(calibrate(file.calibration_points(), file.propeller_tests())));
  }
  std::vector<Finding> findings() const {
    const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
    return examine(file, read_campaign_data(file), {});
  }
  /// What is found of a severity, all in one text.
  std::string found(Severity severity) const {
    std::string text;
    for (const Finding& finding : findings()) {
      if (finding.severity == severity) text += finding.check + ": " + finding.found + "\n";
    }
    return text;
  }
};

TEST_F(Health, OfASoundCampaign) {
  import();
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("calibration: none, so no run can be reduced"));
  calibrate_file();
  EXPECT_EQ(found(Severity::kProblem), "");
  EXPECT_THAT(found(Severity::kNote), HasSubstr("tares: none in S1, S2"));
  for (const Finding& finding : findings())
    EXPECT_TRUE(finding.severity == Severity::kGood || !finding.advice.empty()) << finding.found;
}

TEST_F(Health, StuckAndClippedChannels) {
  campaign.write(folder / "source");
  auto stuck = test::example_frames(400, 1);
  for (std::size_t i = 0; i < 400; ++i) {
    stuck[i * 8 + 4] = stuck[i * 8 + 5] = std::byte{3};
    stuck[i * 8] = std::byte{0xFF};
    stuck[i * 8 + 1] = std::byte{static_cast<unsigned char>(i % 2 == 0 ? 0x0F : 0x0E)};
  }
  test::write_npy(folder / "source/raw/R2.npy", {}, 400, stuck);
  read(true);
  calibrate_file();
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("stuck, never change: R2 channel 3"));
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("clipped: R2 channel 1 (50 %)"));
}

TEST_F(Health, MissingTemperatureAndOffSpeed) {
  const auto at = campaign.runs_csv.find(",20.5");
  campaign.runs_csv.replace(at, 5, ",");
  const auto speed = campaign.runs_csv.find("4999.0");
  campaign.runs_csv.replace(speed, 6, "4900.0");
  import();
  calibrate_file();
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("air_temperature_C is missing in R1"));
  EXPECT_THAT(found(Severity::kNote), HasSubstr("R2 (4900)"));
}

TEST_F(Health, APressureFarFromTheModelsIsNoted) {
  import();
  calibrate_file();
  EXPECT_THAT(found(Severity::kNote), testing::Not(HasSubstr("pressure: ")));
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  CampaignData data = read_campaign_data(file);
  for (tunnelrig::Run& run : data.runs) run.numbers["air_pressure_Pa"] = 95000;
  std::string said;
  for (const Finding& finding : examine(file, data, {}))
    if (finding.check == "pressure") said += finding.found + finding.advice;
  EXPECT_THAT(said,
              HasSubstr("taken for 101325 Pa by the thesis's model; as recorded (95000 Pa on average) it "
                        "makes C_T 6.66 % greater"));
  EXPECT_THAT(said, HasSubstr("`reduce --with air_pressure`"));
}

/// What is said of R1, of so many frames at 1333 Hz and 5000 rev/min, where its channels show these lines.
std::string speeds_said(const CampaignFile& file, std::uint64_t frames, const std::vector<double>& lines_hz) {
  CampaignData data = read_campaign_data(file);
  RunStatistics& statistics = data.statistics.at("R1");
  statistics.frames = frames;
  for (std::size_t c = 0; c < lines_hz.size(); ++c) statistics.channels.at(c).shaft_hz = lines_hz[c];
  std::string text;
  for (const Finding& finding : examine(file, data, {}))
    if (finding.check == "speed" && finding.severity == Severity::kProblem) text += finding.found;
  return text;
}

TEST_F(Health, TheShaftsLineIsKnownToItsBinsAndByTheMiddleChannel) {
  import();
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  const double hz = 5000 / 60.0;
  EXPECT_EQ(speeds_said(file, 100000, {hz, hz, hz, hz + 1}), "") << "one channel took another line for it";
  EXPECT_THAT(speeds_said(file, 100000, {hz, hz + 1, hz + 1, hz + 1}), HasSubstr("R1 (5060 against 5000)"));
  EXPECT_EQ(speeds_said(file, 800, {hz + 1, hz + 1, hz + 1, hz + 1}), "") << "a fifth of a bin of 5.2 Hz";
  EXPECT_THAT(speeds_said(file, 1600, {hz + 3, hz + 3, hz + 3, hz + 3}), HasSubstr("against 5000"));
}

TEST_F(Health, OneFrameIsTooShortAndNotStuck) {
  import();
  EXPECT_THAT(found(Severity::kNote), HasSubstr("their zero is the calibration's, extrapolated\n"))
      << "there is no calibration yet, and no force that it begins at";
  calibrate_file();
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  CampaignData data = read_campaign_data(file);
  RunStatistics& statistics = data.statistics.at("R2");
  statistics.frames = 1;
  for (ChannelStatistics& channel : statistics.channels) channel.lowest_V = channel.highest_V;
  std::string text;
  for (const Finding& finding : examine(file, data, {})) text += finding.found + "\n";
  EXPECT_THAT(text, HasSubstr("one frame only, too short for a mean: R2\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("stuck, never change")));
}

TEST_F(Health, DamagedAndChangedRawData) {
  import();
  calibrate_file();
  Database((folder / "c.db").string(), SQLITE_OPEN_READWRITE)
      .execute("UPDATE raw_chunks SET data = zeroblob(length(data)) WHERE id = (1 << 32)");
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("raw data: damaged blobs in R1"));
}

TEST_F(Health, AnOldCertificateAndAnOpenLedger) {
  import();
  calibrate_file();
  {
    CampaignFile file(folder / "c.db", CampaignFile::Access::kWrite);
    Sheet points = file.sheet("calibration").value();
    points.rows.pop_back();
    file.set_sheet("calibration", points);
    file.database().execute(
        "INSERT INTO ledgers VALUES (1, 500, 400, 50, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, NULL, NULL, NULL, NULL, "
        "'complete', "
        "'tcp:x', 40, 400, '', 0)");
  }
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("the board flags frames as clipped: R1 (10 %)"));
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("the board's test pattern, no measurements: R1"));
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("calibration: made from other points"));
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("loss ledger: emitted is not stored plus lost in R1"));
}

/// Channels are well or have a problem, never both.
TEST_F(Health, AConverterThatErredIsNotSaidToBeWell) {
  import();
  calibrate_file();
  EXPECT_THAT(found(Severity::kGood), HasSubstr("channels: none stuck, dead or clipped"));
  const Database database((folder / "c.db").string(), SQLITE_OPEN_READWRITE);
  database.execute(
      "INSERT INTO ledgers VALUES (1, 400, 400, 0, 0, 0, 0, 0, 0, 8, 0, 0, 1, 0, NULL, NULL, NULL, NULL, "
      "'complete', 'tcp:x', 0, 0, '', 0)");
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("errors of its converter: R1 (2 %)"));
  EXPECT_THAT(found(Severity::kGood), testing::Not(HasSubstr("channels: ")));
}

TEST_F(Health, OfALedgerWithWhatCouldNotBeUsed) {
  import();
  const Database database((folder / "c.db").string(), SQLITE_OPEN_READWRITE);
  database.execute(
      "INSERT INTO ledgers (raw_run, frames_emitted, frames_stored, frames_lost, frames_duplicate, "
      "frames_late, "
      "packets_corrupt, bytes_skipped, frames_overrun, frames_adc_error, reboots, silences, boot_id, "
      "first_sequence, end_reason, source) VALUES (1, 400, 400, 0, 50, 0, 3, 0, 0, 0, 0, 0, 1, 0, "
      "'complete', "
      "'usb')");
  EXPECT_THAT(found(Severity::kNote), HasSubstr("packets: refused: R1 (3)"));
  EXPECT_THAT(found(Severity::kNote),
              HasSubstr("packets: frames under numbers that had passed, dropped: R1 (50)"));
}

/// An imported run has no ledger, but its gaps.
TEST_F(Health, TheGapsOfAnImportAreLosses) {
  campaign.write(folder / "source");
  write_text(folder / "source/raw/R1.gaps.csv", "first_frame,frames_lost,cause,estimated\n100,3,lost,0\n");
  read();
  calibrate_file();
  EXPECT_THAT(found(Severity::kNote), HasSubstr("losses: 3 of "));
  EXPECT_THAT(found(Severity::kNote), HasSubstr("in R1"));
  EXPECT_THAT(found(Severity::kGood), testing::Not(HasSubstr("nothing lost")));
}

TEST_F(Health, OneRecordingOfTwoRuns) {
  const auto at = campaign.runs_csv.find("raw/R2.npy");
  ASSERT_NE(at, std::string::npos);
  campaign.runs_csv.replace(at, 10, "raw/R1.npy");
  import();
  calibrate_file();
  EXPECT_THAT(found(Severity::kProblem), HasSubstr("raw data: the same frames in R1 and R2"));
}

/// What `reduce` would refuse.
TEST_F(Health, TwoTaresAtOneTime) {
  const auto with_second_tare = [&](const char* start) {
    campaign.runs_csv = fmt::format(
        "run,location,repeat,session,start_utc,raw,kind,air_temperature_C\n"
        "T1,OT,1,S1,2026-03-02T08:00:00Z,raw/R1.npy,tare,20\nT2,OT,2,S1,{},raw/R2.npy,tare,20\n"
        "R3,OT,1,S1,2026-03-02T08:05:00Z,raw/R3.npy,,20\n",
        start);
    import();
    calibrate_file();
    return found(Severity::kProblem);
  };
  EXPECT_THAT(with_second_tare("2026-03-02T08:00:00Z"),
              HasSubstr("tares: session S1 has two tares at one time, T1 and T2: correct start_utc"));
  EXPECT_THAT(found(Severity::kGood), testing::Not(HasSubstr("tares")));
  EXPECT_THAT(with_second_tare("2026-03-02T08:10:00Z"), testing::Not(HasSubstr("at one time")));
  EXPECT_THAT(found(Severity::kGood), HasSubstr("tares: every session has one"));
  const CampaignData data = read_campaign_data(CampaignFile(folder / "c.db", CampaignFile::Access::kRead));
  EXPECT_FALSE(data.statistics.at("T1").window_means_V.empty()) << "what slow noise leaves of a zero";
}

/// What `map` would refuse.
TEST_F(Health, ATunnelWithoutTheVehiclesSize) {
  import();
  EXPECT_THAT(found(Severity::kNote), testing::Not(HasSubstr("geometry")));
  const auto at = campaign.campaign_toml.find("vehicle_width_m");
  campaign.campaign_toml.erase(at, campaign.campaign_toml.find('\n', at) - at);
  import();
  EXPECT_THAT(found(Severity::kNote),
              HasSubstr("geometry: campaign.toml has [tunnel] without rig.vehicle_width_m\n"));
  campaign.campaign_toml.erase(campaign.campaign_toml.find("[tunnel]"),
                               std::string("[tunnel]\nwidth_m = 1.5\nheight_m = 1.5\n").size());
  import();
  EXPECT_THAT(found(Severity::kNote), testing::Not(HasSubstr("geometry")))
      << "in open space it is not needed";
}

TEST_F(Health, WhatIsExcludedIsNotHeldAgainstTheRest) {
  campaign.runs_csv.replace(campaign.runs_csv.find("raw/R2.npy"), 10, "raw/R1.npy");
  const auto header = campaign.runs_csv.find('\n');
  std::string excluded = campaign.runs_csv.substr(0, header) + ",excluded\n";
  std::size_t from = header + 1;
  while (from < campaign.runs_csv.size()) {
    const auto end = campaign.runs_csv.find('\n', from);
    const std::string row = campaign.runs_csv.substr(from, end - from);
    excluded += row + (row.starts_with("R2,") ? ",wrong file\n" : ",\n");
    from = end + 1;
  }
  campaign.runs_csv = excluded;
  import();
  calibrate_file();
  EXPECT_EQ(found(Severity::kProblem), "");
}

}  // namespace
}  // namespace tunnelrig
