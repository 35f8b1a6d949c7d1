#include "flight/lidar/carmen_log.h"
#include "flight/lidar/simulated_lidar.h"
#include "flight/tunnel/shapes.h"
#include "support/message_of.h"

#include <cmath>
#include <numbers>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

const CrossSection kSquare(box_outline(1.5, 1.5));

LidarSettings silent() { return {.range_sigma_m = 0, .resolution_m = 0}; }

TEST(Attitude, RotationIsOrthonormalAndTurnsAsStated) {
  const Eigen::Matrix3d r = rotation({0.3, -0.2, 0.7});
  EXPECT_TRUE((r * r.transpose()).isIdentity(1e-12));
  EXPECT_NEAR(r.determinant(), 1, 1e-12);
  EXPECT_GT(section_projection({0.1, 0, 0})(1, 0), 0);  // the right side goes up
}

TEST(SimulatedLidar, MeasuresASquareAtRest) {
  SimulatedLidar lidar(kSquare, silent(), 1);
  const Scan scan = lidar.sweep({{0.25, -0.1}, {}});
  ASSERT_EQ(scan.range_m.size(), 541U);
  EXPECT_NEAR(scan.range_m[90], 0.5, 1e-6);    // to the right
  EXPECT_NEAR(scan.range_m[270], 0.85, 1e-6);  // up
  EXPECT_NEAR(scan.range_m[450], 1.0, 1e-6);   // to the left
}

TEST(SimulatedLidar, RollTurnsAndYawStretches) {
  SimulatedLidar lidar(kSquare, silent(), 1);
  const double roll = 20 * std::numbers::pi / 180;
  const Scan rolled = lidar.sweep({{0, 0}, {roll, 0, 0}});
  EXPECT_NEAR(rolled.range_m[90 - 40], 0.75, 1e-6);
  const double yaw = 0.5;
  const Scan yawed = lidar.sweep({{0, 0}, {0, 0, yaw}});
  EXPECT_NEAR(yawed.range_m[90], 0.75 / std::cos(yaw), 1e-6);
  EXPECT_NEAR(yawed.range_m[270], 0.75, 1e-6);
  const Scan pitched = lidar.sweep({{0, 0}, {0, 0.5, 0}});
  EXPECT_NEAR(pitched.range_m[270], 0.75 / std::cos(0.5), 1e-6);
}

TEST(SimulatedLidar, MotionDuringTheSweepShowsInLaterBeams) {
  SimulatedLidar lidar(kSquare, silent(), 1);
  const Scan scan = lidar.sweep({{0, 0}, {}}, {{0.054, 0}, {}});
  EXPECT_NEAR(scan.range_m[90], 0.75 - 0.009, 1e-6);
  EXPECT_NEAR(scan.range_m[450], 0.75 + 0.045, 1e-6);
}

TEST(SimulatedLidar, NoiseDropOutsAndLimitsAreAsSet) {
  LidarSettings settings{.range_sigma_m = 0.02, .resolution_m = 0, .dropout_share = 0.1};
  SimulatedLidar lidar(kSquare, settings, 7);
  double sum = 0;
  double square = 0;
  int seen = 0;
  int dropped = 0;
  for (int i = 0; i < 2000; ++i) {
    const float range = lidar.sweep({{0, 0}, {}}).range_m[90];
    if (range == 0) {
      ++dropped;
      continue;
    }
    ++seen;
    sum += range - 0.75;
    square += (range - 0.75) * (range - 0.75);
  }
  EXPECT_NEAR(sum / seen, 0, 0.002);
  EXPECT_NEAR(std::sqrt(square / seen), 0.02, 0.0015);
  EXPECT_NEAR(dropped / 2000.0, 0.1, 0.03);
  SimulatedLidar near(kSquare, {.range_sigma_m = 0, .most_range_m = 0.8}, 1);
  EXPECT_EQ(near.sweep({{0, 0}, {}}).range_m[140], 0);  // 25° up: 0.828 m
  EXPECT_NE(near.sweep({{0, 0}, {}}).range_m[90], 0);
}

TEST(SimulatedLidar, PuddlesMirrorOrSwallow) {
  LidarSettings settings = silent();
  settings.puddle_top_m = -0.70;
  settings.puddle_mirror_share = 1;
  const CrossSection wide(box_outline(4, 1.5));
  SimulatedLidar mirroring(wide, settings, 1);
  // 45° down to the right from 0.7 m above the water: 0.99 m to it, then up to the ceiling, 1.45 m above
  EXPECT_NEAR(mirroring.sweep({{-0.9, 0}, {}}).range_m[0], std::sqrt(2.0) * (0.70 + 1.45), 1e-5);
  settings.puddle_mirror_share = 0;
  SimulatedLidar swallowing(wide, settings, 1);
  EXPECT_EQ(swallowing.sweep({{-0.9, 0}, {}}).range_m[0], 0);
}

TEST(SimulatedLidar, SameSeedSameScan) {
  const LidarSettings settings{.range_sigma_m = 0.04, .dropout_share = 0.05};
  SimulatedLidar a(kSquare, settings, 42);
  SimulatedLidar b(kSquare, settings, 42);
  SimulatedLidar c(kSquare, settings, 43);
  const auto first = a.sweep({{0.1, 0}, {}}).range_m;
  EXPECT_EQ(first, b.sweep({{0.1, 0}, {}}).range_m);
  EXPECT_NE(first, c.sweep({{0.1, 0}, {}}).range_m);
}

TEST(SimulatedLidar, SettingsAreChecked) {
  EXPECT_THAT(message_of([] { SimulatedLidar(kSquare, {.range_sigma_m = -1}, 1); }),
              HasSubstr("range_sigma_m"));
  EXPECT_THAT(message_of([] { SimulatedLidar(kSquare, {.rate_hz = 40, .sweep_s = 0.03}, 1); }),
              HasSubstr("sweep_s"));
}

TEST(CarmenLog, ReadsScansAndPassesOverTheRest) {
  const auto scans = parse_carmen_log(
      "# a comment\nPARAM robot_length 0.47 1.0 host 1.0\n\n"
      "FLASER 3 1.5 2 81.91 0.1 0.2 0.3 0.4 0.5 0.6 1071.25 host 2.5\r\nNEFF 1.5\n",
      "x.log");
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].scan.range_m, (std::vector<float>{1.5F, 2, 81.91F}));
  EXPECT_DOUBLE_EQ(scans[0].pose.theta_rad, 0.3);
  EXPECT_DOUBLE_EQ(scans[0].odometry.x_m, 0.4);
  EXPECT_DOUBLE_EQ(scans[0].time_s, 1071.25);
  EXPECT_EQ(scans[0].line, 4);
}

TEST(CarmenLog, RefusesTimeThatGoesBackwardsUnlessToldToTakeIt) {
  const std::string text = "FLASER 2 1 2 0 0 0 0 0 0 7.5 host 1\n\nFLASER 2 1 2 0 0 0 0 0 0 7.4 host 1\n";
  EXPECT_THAT(message_of([&] { parse_carmen_log(text, "x.log"); }),
              AllOf(HasSubstr("x.log:3:"), HasSubstr("7.400 s is before that of line 1")));
  EXPECT_EQ(parse_carmen_log(text, "x.log", LogTime::kAsLogged).size(), 2U);
}

TEST(CarmenLog, ErrorsNameTheLine) {
  const auto wrong = [](const std::string& text) {
    return message_of([&] { parse_carmen_log(text, "x.log"); });
  };
  EXPECT_THAT(wrong("\nFLASER"), AllOf(HasSubstr("x.log:2:"), HasSubstr("number of ranges")));
  EXPECT_THAT(wrong("FLASER 3 1 2"), HasSubstr("ends before its range"));
  EXPECT_THAT(wrong("FLASER 2 1 2 0 0 0 0 0 0"), HasSubstr("ends before its time"));
  EXPECT_THAT(wrong("FLASER 2 1 nan 0 0 0 0 0 0 0"), HasSubstr("\"nan\""));
  EXPECT_THAT(wrong("FLASER 2 1 1e30 0 0 0 0 0 0 0"), HasSubstr("no LIDAR"));
  EXPECT_THAT(wrong("FLASER 1e9 1"), HasSubstr("whole number"));
  EXPECT_THAT(wrong("FLASER 2.5 1"), HasSubstr("whole number"));
}

}  // namespace
}  // namespace tunnelrig
