// The matcher against simulated scans, whose simulation shares no code with it.
#include "flight/localisation/scan_matcher.h"

#include "flight/lidar/simulated_lidar.h"
#include "flight/localisation/cramer_rao.h"
#include "flight/tunnel/shapes.h"
#include "flight/tunnel/tunnel.h"
#include "support/message_of.h"
#include "support/seeds.h"

#include <cmath>
#include <random>
#include <string>
#include <tuple>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

const CrossSection kSquare(box_outline(1.5, 1.5));

CrossSection furnished() {
  return CrossSection(
      with_features(box_outline(2.4, 2.4), {{1, 1.5, 1.7, 0.1}, {3, 0.3, 1.3, -0.5}}, "furnished"));
}

/// Beams from `first` on, for a share of the scan, stopped short by something near.
void block(Scan& scan, std::size_t first, double share) {
  const auto count = static_cast<std::size_t>(share * static_cast<double>(scan.range_m.size()));
  for (std::size_t i = first; i < std::min(first + count, scan.range_m.size()); ++i)
    scan.range_m[i] = std::min(scan.range_m[i], 0.2F);
}

struct Section {
  std::string name;
  CrossSection section;
  double reach_m;  // of positions
  MatcherSettings settings;
};

std::vector<Section> sections() {
  MatcherSettings two;
  MatcherSettings all;
  all.form = HoughForm::all_directions;
  MatcherSettings circle;
  circle.form = HoughForm::circle;
  circle.circle_diameter_m = 2;
  return {{"square", kSquare, 0.4, two},
          {"square_all", kSquare, 0.4, all},
          {"furnished", furnished(), 0.7, two},
          {"arch", CrossSection(arch_outline(4.5, 5, 2.75)), 1.2, two},
          {"arch_all", CrossSection(arch_outline(4.5, 5, 2.75)), 1.2, all},
          {"circle", CrossSection(circle_outline(2)), 0.35, circle},
          {"circle_all", CrossSection(circle_outline(2)), 0.35, all}};
}

/// Section × noise × share of blocked beams × rotation left unknown.
using Case = std::tuple<int, double, double, bool>;

class MatcherProperty : public testing::TestWithParam<Case> {};

TEST_P(MatcherProperty, FindsThePositionWithinItsOwnCovariance) {
  const auto& [which, sigma_m, blocked, turned] = GetParam();
  Section given = sections()[static_cast<std::size_t>(which)];
  if (turned) given.settings.unknowns = Unknowns::rotation;
  SCOPED_TRACE(testing::Message() << given.name << ", seed " << test::seed());
  ScanMatcher matcher(given.section, given.settings);
  SimulatedLidar lidar(given.section, {.range_sigma_m = sigma_m, .dropout_share = 0.02}, test::seed());
  std::mt19937_64 random(test::seed() + 1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr int kMatches = 60;
  double nees = 0;
  int rejected = 0;
  for (int i = 0; i < kMatches; ++i) {
    const SectionPoint at(given.reach_m * uniform(random), given.reach_m * uniform(random));
    // Known tilts about all three axes, and a rotation that only the scan shows
    const Attitude imu{0.3 * uniform(random), 0.2 * uniform(random), 0.2 * uniform(random)};
    const double rotation = turned ? 0.17 * uniform(random) : 0;
    Scan scan = lidar.sweep({at, {imu.roll_rad + rotation, imu.pitch_rad, imu.yaw_rad}});
    block(scan, static_cast<std::size_t>(150 + 100 * uniform(random)), blocked);
    const Match match = matcher.match(scan, imu);
    if (!match.accepted) {
      ++rejected;
      continue;
    }
    const SectionPoint error = match.position_m - at;
    EXPECT_LT(error.norm(), 0.05) << at.transpose();
    if (turned) {
      EXPECT_NEAR(match.rotation_rad, rotation, 0.03);
    }
    nees += error.dot(match.covariance_m2.inverse() * error);
  }
  // A fifth of the sight is the most that may be hidden, so that noise decides now and then.
  EXPECT_LE(rejected, blocked > 0 ? 4 : 0);
  nees /= kMatches - rejected;
  // Chi-square with 2 × 60 degrees of freedom: 99.99 % lie between 1.14 and 3.12; whole millimetres, corners
  // and many edges for a curve add a little to the upper end.
  EXPECT_GT(nees, 1.14);
  EXPECT_LT(nees, 3.5);
}

INSTANTIATE_TEST_SUITE_P(All, MatcherProperty,
                         testing::Combine(testing::Values(0, 1, 2, 3, 4), testing::Values(0.01, 0.04),
                                          testing::Values(0.0, 0.2), testing::Bool()));
// A circle looks the same from everywhere on its axis when rotated: only with the attitude known.
INSTANTIATE_TEST_SUITE_P(Circles, MatcherProperty,
                         testing::Combine(testing::Values(5, 6), testing::Values(0.01, 0.04),
                                          testing::Values(0.0, 0.2), testing::Values(false)));

TEST(ScanMatcher, ReachesTheCramerRaoBound) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  ScanMatcher matcher(kSquare);
  SimulatedLidar lidar(kSquare, {.range_sigma_m = 0.04}, test::seed());
  const SectionPoint at(0.2, -0.15);
  const Eigen::MatrixXd bound = cramer_rao_bound(kSquare, {}, at, {}, 0.04);
  SectionPoint square(0, 0);
  constexpr int kMatches = 2000;
  for (int i = 0; i < kMatches; ++i) {
    const Match match = matcher.match(lidar.sweep({at, {}}), {});
    ASSERT_TRUE(match.accepted);
    square += (match.position_m - at).cwiseAbs2() / kMatches;
  }
  EXPECT_LT(std::sqrt(square.x() / bound(0, 0)), 1.1);
  EXPECT_LT(std::sqrt(square.y() / bound(1, 1)), 1.1);
  // The bound itself: by hand for one beam straight at a wall, σ² of its range
  const Eigen::MatrixXd cross = cramer_rao_bound(kSquare, {2, 0, std::acos(0.0)}, {0, 0}, {}, 0.04);
  EXPECT_NEAR(cross(0, 0), 0.0016, 1e-9);
  EXPECT_NEAR(cross(1, 1), 0.0016, 1e-9);
}

TEST(ScanMatcher, ShiftedScansGiveShiftedPositions) {
  ScanMatcher matcher(kSquare);
  SimulatedLidar lidar(kSquare, {.range_sigma_m = 0, .resolution_m = 0}, 1);
  for (int step = -5; step <= 5; ++step) {
    const double shift = 0.0025 * step;  // far less than a cell
    const SectionPoint at(0.1 + shift, -0.2 - shift);
    EXPECT_LT((matcher.match(lidar.sweep({at, {}}), {}).position_m - at).norm(), 1e-5);
  }
}

TEST(ScanMatcher, HeadingShowsInTheWidth) {
  MatcherSettings settings;
  settings.unknowns = Unknowns::rotation_and_heading;
  ScanMatcher matcher(kSquare, settings);
  SimulatedLidar lidar(kSquare, {.range_sigma_m = 0.01}, test::seed());
  for (const double yaw : {-0.6, -0.3, 0.2, 0.5}) {
    const Match match = matcher.match(lidar.sweep({{0.1, 0.1}, {0.05, 0, yaw}}), {});
    ASSERT_TRUE(match.accepted) << text(match.reason) << yaw;
    EXPECT_NEAR(match.heading_rad, std::abs(yaw), 0.02 + 3 * match.heading_sigma_rad);
    EXPECT_LT(match.heading_sigma_rad, 0.03);
    EXPECT_LT((match.position_m - SectionPoint(0.1, 0.1)).norm(), 0.01);
  }
}

TEST(ScanMatcher, RejectsAScanOfAnotherTunnel) {
  SimulatedLidar lidar(tunnel_from("2.4").section, {.range_sigma_m = 0.01}, test::seed());
  ScanMatcher matcher(kSquare);
  int accepted = 0;
  for (int i = 0; i < 50; ++i)
    accepted += matcher.match(lidar.sweep({{-0.6 + 0.024 * i, 0.02 * i - 0.5}, {}}), {}).accepted ? 1 : 0;
  EXPECT_EQ(accepted, 0);
  SimulatedLidar small(CrossSection(box_outline(1.2, 1.2)), {.range_sigma_m = 0.01}, test::seed());
  EXPECT_FALSE(matcher.match(small.sweep({{0, 0}, {}}), {}).accepted);
}

TEST(ScanMatcher, RejectsBlockedAndEmptySight) {
  ScanMatcher matcher(kSquare);
  SimulatedLidar lidar(kSquare, {.range_sigma_m = 0.01}, test::seed());
  Scan blocked = lidar.sweep({{0, 0}, {}});
  block(blocked, 0, 0.8);
  const Match of_blocked = matcher.match(blocked, {});
  EXPECT_FALSE(of_blocked.accepted) << of_blocked.position_m.transpose() << ", quality " << of_blocked.quality
                                    << ", residual " << of_blocked.residual_m;
  Scan dark;
  dark.range_m.assign(541, 0);
  EXPECT_EQ(matcher.match(dark, {}).reason, Rejection::few_beams);
}

TEST(ScanMatcher, RejectsWhatDoesNotFixThePosition) {
  // One wall in sight of a long, wide hall
  const CrossSection hall(box_outline(200, 8));
  ScanMatcher matcher(hall);
  SimulatedLidar lidar(hall, {.range_sigma_m = 0.01, .most_range_m = 10}, test::seed());
  const Match match = matcher.match(lidar.sweep({{0, 0}, {}}), {});
  EXPECT_FALSE(match.accepted);
  EXPECT_EQ(match.reason, Rejection::unobservable) << text(match.reason);
}

TEST(ScanMatcher, AmbiguousPlacesAreToldApartByAPrior) {
  // Two equal chambers beside each other, seen as one section by a gap
  const CrossSection twin(
      {{-2, -1}, {-0.1, -1}, {-0.1, 0.9}, {0.1, 0.9}, {0.1, -1}, {2, -1}, {2, 1}, {-2, 1}});
  SimulatedLidar lidar(twin, {.range_sigma_m = 0.01}, test::seed());
  MatcherSettings settings;
  settings.most_range_m = 1.4;  // neither the other chamber nor its far wall
  ScanMatcher matcher(twin, settings);
  const SectionPoint at(1.05, -0.2);
  const Scan scan = lidar.sweep({at, {}});
  EXPECT_EQ(matcher.match(scan, {}).reason, Rejection::ambiguous);
  const Match match = matcher.match(scan, {}, SectionPoint(1.0, -0.1));
  ASSERT_TRUE(match.accepted) << text(match.reason);
  EXPECT_LT((match.position_m - at).norm(), 0.01);
}

TEST(ScanMatcher, AnUncertainPriorIsSearchedAroundAsFarAsItMayBeWrong) {
  SimulatedLidar lidar(kSquare, {.range_sigma_m = 0.01}, test::seed());
  ScanMatcher matcher(kSquare);
  const SectionPoint at(0.4, 0), believed(-0.2, 0);
  const Scan scan = lidar.sweep({at, {}});
  EXPECT_FALSE(matcher.match(scan, {}, believed).accepted) << "it is said to be within 0.25 m";
  const Match match = matcher.match(scan, {}, SearchPrior(believed, {0.2, 0.01}));
  ASSERT_TRUE(match.accepted) << text(match.reason);
  EXPECT_LT((match.position_m - at).norm(), 0.01);
}

TEST(ScanMatcher, PuddlesDropOutsAndMotionAreBorne) {
  SimulatedLidar lidar(
      kSquare,
      {.range_sigma_m = 0.01, .dropout_share = 0.1, .puddle_top_m = -0.74, .puddle_mirror_share = 0.5},
      test::seed());
  ScanMatcher matcher(kSquare);
  for (int i = 0; i < 100; ++i) {
    const SectionPoint start(-0.2 + 0.004 * i, -0.3);
    const SectionPoint end = start + SectionPoint(0.008, 0);  // 0.43 m/s over the sweep
    const Match match = matcher.match(lidar.sweep({start, {}}, {end, {}}), {});
    ASSERT_TRUE(match.accepted) << text(match.reason);
    EXPECT_LT((match.position_m - (start + end) / 2).norm(), 0.012);  // the middle of the sweep
  }
}

/// Ranges as they are: what is left is the matcher's own doing.
LidarSettings exact() { return {.range_sigma_m = 0, .resolution_m = 0}; }

/// A match with the motion known is as exact as one at rest; without it, it is off by millimetres.
TEST(ScanMatcher, KnownMotionIsTakenOutOfTheSweep) {
  for (const Section& given : sections()) {
    SCOPED_TRACE(given.name);
    SimulatedLidar lidar(given.section, exact(), 1);
    ScanMatcher matcher(given.section, given.settings);
    const double sweep_s = lidar.settings().sweep_s;
    double known_m = 0, unknown_m = 0;
    for (int i = 0; i < 12; ++i) {
      const double angle = 0.5 * i;
      const SectionPoint middle = 0.8 * given.reach_m * SectionPoint(std::cos(angle), std::sin(angle));
      const SectionPoint velocity(-std::sin(2 * angle), std::cos(2 * angle));
      const Attitude imu{0.1, 0.05, -0.05};
      const SweepMotion motion{sweep_s, velocity, 0.5, 20};
      const auto pose = [&](double s) -> LidarPose {
        const double roll_rad =
            imu.roll_rad + s * motion.roll_rate_rad_s + 0.5 * s * s * motion.roll_acceleration_rad_s2;
        return {middle + s * velocity, {roll_rad, imu.pitch_rad, imu.yaw_rad}};
      };
      std::vector<LidarPose> path;
      for (int k = -8; k <= 8; ++k) path.push_back(pose(k * sweep_s / 16));
      const Scan scan = lidar.sweep(path);
      const Match match = matcher.match(scan, imu, {}, motion);
      ASSERT_TRUE(match.accepted) << text(match.reason);
      known_m = std::max(known_m, (match.position_m - middle).norm());
      unknown_m = std::max(unknown_m, (matcher.match(scan, imu).position_m - middle).norm());
    }
    EXPECT_LT(known_m, 5e-4);
    EXPECT_GT(unknown_m, 2e-3);
  }
}

TEST(ScanMatcher, AMotionThatCannotBeIsARejection) {
  SimulatedLidar lidar(kSquare, exact(), 1);
  ScanMatcher matcher(kSquare);
  const Scan scan = lidar.sweep({{0.1, 0.1}, {}});
  for (const double speed : {300.0, 1e30, 1e300}) {
    const Match match = matcher.match(scan, {}, {}, {0.02, {speed, -speed}, speed, speed});
    EXPECT_FALSE(match.accepted);
    EXPECT_TRUE(match.position_m.allFinite());
    EXPECT_TRUE(matcher.moved_per_roll_m().allFinite());
  }
  EXPECT_TRUE(matcher.match(scan, {}).accepted) << "as laid out again";
}

TEST(ScanMatcher, SaysHowItMovesWithTheAttitudesError) {
  for (const Section& given : sections()) {
    SCOPED_TRACE(given.name);
    SimulatedLidar lidar(given.section, exact(), 1);
    ScanMatcher matcher(given.section, given.settings);
    for (int i = 0; i < 6; ++i) {
      const SectionPoint at = given.reach_m * SectionPoint(std::cos(i), std::sin(i));
      const Attitude imu{0.1, 0.05, -0.05};
      const Scan scan = lidar.sweep({at, imu});
      constexpr double kError_rad = 0.001;
      const auto position = [&](double error_rad) {
        return matcher.match(scan, {imu.roll_rad + error_rad, imu.pitch_rad, imu.yaw_rad}).position_m;
      };
      const SectionPoint moved_m = position(kError_rad) - position(-kError_rad);
      // To first order, and small features are seen by other beams when the scan turns.
      const SectionPoint off_m = 2 * kError_rad * matcher.moved_per_roll_m() - moved_m;
      EXPECT_LT(off_m.norm(), 0.2 * moved_m.norm() + 5e-5) << at.transpose();
    }
  }
}

TEST(ScanMatcher, BadInputIsAnError) {
  ScanMatcher matcher(kSquare);
  Scan scan;
  EXPECT_THAT(message_of([&] { matcher.match(scan, {}); }), HasSubstr("empty"));
  scan.range_m.assign(540, 1);
  EXPECT_THAT(message_of([&] { matcher.match(scan, {}); }), HasSubstr("540 beams"));
  scan.range_m.assign(541, 1);
  scan.range_m[17] = NAN;
  EXPECT_THAT(message_of([&] { matcher.match(scan, {}); }), HasSubstr("beam 17"));
  scan.range_m[17] = 1;
  EXPECT_THAT(message_of([&] { matcher.match(scan, {NAN, 0, 0}); }), HasSubstr("attitude"));
  EXPECT_THAT(message_of([&] { matcher.match(scan, {0, 0, 1.5}); }), HasSubstr("75°"));
  EXPECT_THAT(message_of([&] { matcher.match(scan, {}, SectionPoint(NAN, 0)); }), HasSubstr("prior"));
  EXPECT_THAT(message_of([&] {
                matcher.match(scan, {}, SearchPrior({0, 0}, {0, INFINITY}));
              }),
              HasSubstr("prior"));
  EXPECT_THAT(message_of([&] { matcher.match(scan, {}, {}, {0.02, {NAN, 0}}); }), HasSubstr("motion"));
  EXPECT_THAT(message_of([] { ScanMatcher(kSquare, {.cell_m = 0}); }), HasSubstr("cell_m"));
  EXPECT_THAT(message_of([] { ScanMatcher(kSquare, {.form = HoughForm::circle}); }),
              HasSubstr("circle_diameter_m"));
}

}  // namespace
}  // namespace tunnelrig
