// Scans that do not tell where they were taken: the matcher must say so instead of answering wrongly.
#include "flight/lidar/simulated_lidar.h"
#include "flight/localisation/scan_matcher.h"
#include "flight/tunnel/shapes.h"
#include "flight/tunnel/tunnel.h"
#include "support/seeds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

constexpr int kScans = 400;
const CrossSection kSquare(box_outline(1.5, 1.5));

class Draw {
 public:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  SectionPoint place(double reach_m) {
    const double y = between(-reach_m, reach_m);
    return {y, between(-reach_m, reach_m)};
  }

 private:
  std::mt19937_64 engine_{test::seed()};
};

struct WrongTunnel {
  std::string name;
  CrossSection seen;
  CrossSection drawn;
  double reach_m;
  MatcherSettings settings;
};

std::vector<WrongTunnel> wrong_tunnels() {
  MatcherSettings circle;
  circle.form = HoughForm::circle;
  circle.circle_diameter_m = 2;
  const CrossSection wide = tunnel_from("2.4").section;
  const CrossSection round(circle_outline(2));
  const CrossSection slit(box_outline(1.5, 200));
  std::vector<WrongTunnel> all{{"wider", wide, kSquare, 0.6, {}},
                               {"narrower", kSquare, wide, 0.3, {}},
                               {"arch", tunnel_from("railway").section, wide, 0.3, {}},
                               {"circle", round, kSquare, 0.2, {}},
                               {"no_circle", kSquare, round, 0.2, circle},
                               {"taller", CrossSection(box_outline(1.5, 3)), kSquare, 0.3, {}},
                               {"slit", slit, kSquare, 0.3, {}},
                               {"slit_known", slit, slit, 0.3, {}}};
  for (const int width_mm : {1200, 1300, 1400, 1600, 1700})
    all.push_back({fmt::format("square_{}", width_mm),
                   CrossSection(box_outline(1e-3 * width_mm, 1e-3 * width_mm)),
                   kSquare,
                   0.2,
                   {}});
  return all;
}

class WrongTunnels : public testing::TestWithParam<WrongTunnel> {};

TEST_P(WrongTunnels, AreRejected) {
  const WrongTunnel& given = GetParam();
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  SimulatedLidar lidar(given.seen, {.range_sigma_m = 0.01}, test::seed());
  ScanMatcher matcher(given.drawn, given.settings);
  Draw draw;
  for (int i = 0; i < kScans; ++i) {
    const SectionPoint at = draw.place(given.reach_m);
    const Match match = matcher.match(lidar.sweep({at, {}}), {});
    ASSERT_FALSE(match.accepted) << at.transpose() << " matched at " << match.position_m.transpose()
                                 << ", quality " << match.quality << ", residual " << match.residual_m;
  }
}

INSTANTIATE_TEST_SUITE_P(All, WrongTunnels, testing::ValuesIn(wrong_tunnels()),
                         [](const auto& given) { return given.param.name; });

/// Spoils a scan of the right tunnel.
struct Spoiled {
  std::string name;
  std::function<void(Scan&, Draw&)> spoil;
  double least_accepted;  // share of the scans that must be
  double most_accepted;
};

/// A share of the beams side by side: without a return, or stopped short at one distance.
std::function<void(Scan&, Draw&)> some_beams(double share, bool returned) {
  return [=](Scan& scan, Draw& draw) {
    const auto beams = static_cast<double>(scan.range_m.size());
    const auto first = static_cast<std::size_t>(draw.between(0, (1 - share) * beams));
    const auto near_m = static_cast<float>(draw.between(0.1, 0.5));
    for (std::size_t i = 0; i < static_cast<std::size_t>(share * beams); ++i)
      scan.range_m[first + i] = returned ? std::min(scan.range_m[first + i], near_m) : 0;
  };
}

std::vector<Spoiled> spoiled_scans() {
  std::vector<Spoiled> all;
  for (const int per_cent : {10, 20}) {
    all.push_back({fmt::format("blocked_{}", per_cent), some_beams(0.01 * per_cent, true), 0.9, 1});
    all.push_back({fmt::format("dark_{}", per_cent), some_beams(0.01 * per_cent, false), 0.99, 1});
  }
  for (const int per_cent : {30, 40, 60, 80}) {
    all.push_back({fmt::format("blocked_{}", per_cent), some_beams(0.01 * per_cent, true), 0, 0.1});
    all.push_back({fmt::format("dark_{}", per_cent), some_beams(0.01 * per_cent, false), 0, 1});
  }
  all.push_back({"at_random",
                 [](Scan& scan, Draw& draw) {
                   for (float& range : scan.range_m) range = static_cast<float>(draw.between(0.1, 2));
                 },
                 0, 0});
  all.push_back({"in_a_hood",
                 [](Scan& scan, Draw& draw) {
                   scan.range_m.assign(scan.range_m.size(), static_cast<float>(draw.between(0.3, 1.2)));
                 },
                 0, 0});
  for (const int in_front_mm : {100, 200, 300})
    all.push_back({fmt::format("sheet_{}_mm_before_a_wall", in_front_mm),
                   [=](Scan& scan, Draw&) {
                     const BeamLayout layout;
                     for (std::size_t i = 0; i < scan.range_m.size(); ++i)
                       if (std::cos(layout.angle_rad(i)) > 0.5)
                         scan.range_m[i] *= static_cast<float>(1 - 1e-3 * in_front_mm / 0.75);
                   },
                   0, 0.1});
  return all;
}

class SpoiledScans : public testing::TestWithParam<Spoiled> {};

TEST_P(SpoiledScans, AreRejectedOrMatchedRightly) {
  const Spoiled& given = GetParam();
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  ScanMatcher matcher(kSquare);
  SimulatedLidar lidar(kSquare, {.range_sigma_m = 0.01}, test::seed());
  Draw draw;
  int accepted = 0;
  for (int i = 0; i < kScans; ++i) {
    const SectionPoint at = draw.place(0.3);
    Scan scan = lidar.sweep({at, {}});
    given.spoil(scan, draw);
    const Match match = matcher.match(scan, {});
    if (!match.accepted) continue;
    ++accepted;
    EXPECT_LT((match.position_m - at).norm(), 0.1)
        << at.transpose() << ", quality " << match.quality << ", residual " << match.residual_m;
  }
  EXPECT_GE(accepted, given.least_accepted * kScans);
  EXPECT_LE(accepted, given.most_accepted * kScans);
}

INSTANTIATE_TEST_SUITE_P(All, SpoiledScans, testing::ValuesIn(spoiled_scans()),
                         [](const auto& given) { return given.param.name; });

}  // namespace
}  // namespace tunnelrig
