#include "datasets/calibration_doubts.h"

#include "analysis/run_summary.h"
#include "datasets/campaign_folder.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <functional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// The example's points, by another pen: `change` gives a line's force and reading.
struct CalibrationDoubts : testing::Test {
  test::TemporaryFolder folder;
  test::ExampleCampaign campaign;

  using Change = std::function<void(double& force_N, double& voltage_V)>;

  void write_points(const Change& change) {
    const Sheet sheet = parse_csv(campaign.calibration_csv, "calibration.csv");
    campaign.calibration_csv = "cell,applied_force_N,voltage_V\n";
    for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
      double force_N = sheet.require_number(row, "applied_force_N"),
             voltage_V = sheet.require_number(row, "voltage_V");
      change(force_N, voltage_V);
      campaign.calibration_csv += fmt::format("{},{},{}\n", sheet.text(row, "cell"), force_N, voltage_V);
    }
  }

  std::vector<std::string> doubts_of_import() {
    campaign.write(folder / "source");
    ImportOptions options{.replace = true};
    options.summarizer = [](const CampaignInfo& info, const RawFormat& format) {
      return make_run_summarizer(info, format);
    };
    return import_campaign_folder(folder / "source", folder / "c.db", options).doubts;
  }
};

TEST_F(CalibrationDoubts, NothingIsSaidOfSoundPoints) {
  EXPECT_THAT(doubts_of_import(), IsEmpty());
  write_points([](double& force_N, double&) { force_N = -force_N; });
  EXPECT_THAT(doubts_of_import(), IsEmpty()) << "a cell that pulls";
  write_points([](double& force_N, double&) { force_N *= 20; });
  for (const char* speed : {"5000.0", "4999.0", "5001.5"})
    campaign.runs_csv.replace(campaign.runs_csv.find(speed), 6, "20000");
  EXPECT_THAT(doubts_of_import(), IsEmpty()) << "a rotor that gives twenty times as much has larger loads";
}

/// A small propeller on a cell of 1 kg, which is calibrated over its range and whose zero has moved since.
TEST_F(CalibrationDoubts, ACellMayCarryMoreThanItsRotorGives) {
  campaign.campaign_toml =
      "format = \"tunnelrig-campaign/1\"\n[rig]\npropeller_radius_m = 0.023\nnominal_speed_rpm = 5000\n";
  write_points([](double& force_N, double& voltage_V) { voltage_V = 2.15 + 0.1 * force_N; });
  EXPECT_THAT(doubts_of_import(), IsEmpty());
}

TEST_F(CalibrationDoubts, MillivoltsAndExchangedColumns) {
  write_points([](double&, double& voltage_V) { voltage_V *= 1000; });
  EXPECT_THAT(
      doubts_of_import(),
      ElementsAre(AllOf(HasSubstr("calibration.csv:2: column voltage_V: 2"),
                        HasSubstr("V is beyond the converter's reference of 3.3 V (daq.adc_reference_V): "
                                  "are these volts (not mV or counts)?"))));
  campaign = {};
  write_points([](double& force_N, double& voltage_V) { std::swap(force_N, voltage_V); });
  EXPECT_THAT(doubts_of_import(), ElementsAre(HasSubstr("are voltage_V and applied_force_N exchanged?")));
}

TEST_F(CalibrationDoubts, GramsAreMoreThanRotorAndCellAreMadeFor) {
  write_points([](double& force_N, double&) { force_N *= 1000 / 9.80665; });
  EXPECT_THAT(doubts_of_import(),
              ElementsAre(AllOf(HasSubstr("calibration.csv:2: column applied_force_N: "),
                                HasSubstr("(83.6 N at most)"), HasSubstr("are these newtons (not grams)?"))));
}

/// One cell of four, and loads that a larger cell might carry: what was recorded tells.
TEST_F(CalibrationDoubts, WhatRunsBecomeTellsGramsOfALargeCell) {
  campaign.campaign_toml.replace(campaign.campaign_toml.find("[tunnel]"), 0, "cell_limit_N = 1000\n");
  EXPECT_THAT(doubts_of_import(), IsEmpty());
  int row = 0;
  write_points([&](double& force_N, double&) {
    if (row++ / 10 == 2) force_N *= 1000 / 9.80665;
  });
  EXPECT_THAT(doubts_of_import(),
              ElementsAre(AllOf(HasSubstr("calibration.csv: by the points of cell 3 the 2.2"),
                                HasSubstr("V of a thrust run are 8"),
                                HasSubstr("are its forces newtons (not grams), its readings volts"))));
}

/// Points of a bench that are not in the file.
TEST_F(CalibrationDoubts, OfOtherPointsThanTheFiles) {
  EXPECT_THAT(doubts_of_import(), IsEmpty());
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  auto points = file.calibration_points();
  EXPECT_THAT(calibration_doubts(file, points), IsEmpty());
  points[5].voltage_V *= 1000;
  EXPECT_THAT(calibration_doubts(file, points), ElementsAre(HasSubstr("calibration.csv:7: ")));
}

}  // namespace
}  // namespace tunnelrig
