// The matcher on a real log: successive scans of freiburg-079 (Radish), each the reference of the next.
#include "flight/lidar/carmen_log.h"
#include "flight/localisation/scan_matcher.h"
#include "flight/localisation/scan_section.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

/// Where b stands as seen from a, right and ahead.
SectionPoint motion(const PlanarPose& a, const PlanarPose& b) {
  const double dx = b.x_m - a.x_m;
  const double dy = b.y_m - a.y_m;
  const double ahead = std::cos(a.theta_rad) * dx + std::sin(a.theta_rad) * dy;
  const double left = -std::sin(a.theta_rad) * dx + std::cos(a.theta_rad) * dy;
  return {-left, ahead};
}

std::vector<CarmenScan> freiburg(const test::TemporaryFolder& folder) {
  const auto packed = test::shared_data() / "lidar_radish" / "freiburg-079-corrected.log.gz";
  const auto log = folder / "freiburg.log";
  const std::string command = fmt::format("gzip -dc '{}' > '{}'", packed.string(), log.string());
  if (std::system(command.c_str()) != 0) return {};
  return read_carmen_log(log);
}

MatcherSettings scan_to_scan(std::size_t beams) {
  return {.layout = carmen_layout(beams),
          .form = HoughForm::all_directions,
          .unknowns = Unknowns::rotation,
          .cell_m = 0.01,
          .smoothing_m = 0.06,
          .rotation_search_rad = 0.07,
          .most_range_m = 50,
          .first_gate_m = 0.3,
          .gate_sigma = 3,
          .most_slope = 3,  // the outline is rough where it was seen at a glance
          .least_sigma_m = 0.005,
          .prior_gate_m = 0.5,
          .vantage_spread = 0,
          .least_inliers = 0.4,
          .most_beyond = 1,  // a room has more behind its corners than the scan before saw
          .least_facing = 0,
          .most_misfit_m = 1,
          .ambiguity = 1};
}

TEST(RealScans, SuccessiveScansOfFreiburg079) {
  SKIP_WITHOUT_SHARED_DATA();
  const test::TemporaryFolder folder;
  const std::vector<CarmenScan> log = freiburg(folder);
  ASSERT_GT(log.size(), 4000U);
  constexpr std::size_t kEvery = 4;  // pair: time
  std::vector<double> error_m;
  std::vector<double> moved_m;
  int rejected = 0;
  for (std::size_t i = 0; i + 1 < log.size(); i += kEvery) {
    const MatcherSettings settings = scan_to_scan(log[i].scan.range_m.size());
    ScanMatcher matcher(
        section_from_scan(log[i].scan, settings.layout, {.tolerance_m = 0.02, .most_range_m = 50}), settings);
    const double turned = log[i + 1].odometry.theta_rad - log[i].odometry.theta_rad;  // in the IMU's place
    const Match match = matcher.match(log[i + 1].scan, {turned, 0, 0}, SectionPoint(0, 0));
    const SectionPoint truth = motion(log[i].pose, log[i + 1].pose);
    moved_m.push_back(truth.norm());
    if (match.accepted)
      error_m.push_back((match.position_m - truth).norm());
    else
      ++rejected;
  }
  const auto median = [](std::vector<double>& values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                     values.end());
    return values[values.size() / 2];
  };
  const double median_mm = 1e3 * median(error_m);
  std::cout << fmt::format("{} pairs, {} rejected, median step {:.0f} mm, median error {:.1f} mm\n",
                           moved_m.size(), rejected, 1e3 * median(moved_m), median_mm);
  EXPECT_LE(median_mm, 21);
  EXPECT_LT(rejected, static_cast<int>(moved_m.size()) / 50);
}

TEST(ScanSection, KeepsWhatTheScanSaw) {
  const BeamLayout layout = carmen_layout(180);
  Scan scan;
  for (std::size_t i = 0; i < layout.beams; ++i) {
    const double angle = layout.angle_rad(i);
    scan.range_m.push_back(static_cast<float>(
        std::min(2 / std::max(1e-9, std::abs(std::cos(angle))), 3 / std::max(1e-9, std::sin(angle)))));
  }
  const CrossSection section = section_from_scan(scan, layout);
  EXPECT_LT(section.vertices().size(), 16U);  // a box and what closes it behind
  EXPECT_NEAR(section.ray({0.5, 1}, {1, 0}), 1.5, 0.02);
  EXPECT_NEAR(section.ray({0.5, 1}, {0, 1}), 2, 0.02);
  scan.range_m.assign(180, 0);
  EXPECT_THAT(test::message_of([&] { section_from_scan(scan, layout); }), testing::HasSubstr("0 returns"));
}

}  // namespace
}  // namespace tunnelrig
