// Where a map interpolates and where it extrapolates.
#include "analysis/maps/measured_region.h"

#include "analysis/maps/picture.h"
#include "analysis/maps/write_maps.h"
#include "datasets/csv.h"
#include "published_input.h"
#include "support/temporary_folder.h"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using testing::HasSubstr;

TEST(MeasuredRegion, IsTheHullOfTheLocationsAndTheirMirrorImages) {
  const MeasuredRegion region({{0, 0}, {0.5, 0.5}, {0.5, -0.25}, {0.2, 0.1}, {0, -0.5}});
  EXPECT_EQ(region.corners().size(), 5u) << "two above, two at the side, one below";
  for (const double side : {-1, 1}) {
    EXPECT_TRUE(region.holds({side * 0.5, 0.5}));
    EXPECT_TRUE(region.holds({side * 0.5, 0}));
    EXPECT_TRUE(region.holds({0, 0.4})) << "between a location and its image";
    EXPECT_FALSE(region.holds({side * 0.51, 0}));
    EXPECT_FALSE(region.holds({side * 0.4, -0.4}));
  }
  EXPECT_NEAR(region.share_outside(), 1 - (0.75 + 0.5 * 0.25) / 4, 1e-12);
}

TEST(MeasuredRegion, OfALineIsThatLineAndOfNothingNothing) {
  const MeasuredRegion line({{0, 0}, {0, 0.5}, {0, -0.5}});
  EXPECT_TRUE(line.holds({0, 0.2}) && line.holds({0, 0.5}));
  EXPECT_FALSE(line.holds({0, 0.6}) || line.holds({0.01, 0}));
  EXPECT_EQ(line.share_outside(), 1);
  const MeasuredRegion point({{0, 0}});
  EXPECT_TRUE(point.holds({0, 0}));
  EXPECT_FALSE(point.holds({0.1, 0}));
  EXPECT_FALSE(MeasuredRegion({}).holds({0, 0}));
}

TEST(MeasuredRegion, OfTheThesissLocationsLeavesAMarginOfSixPerCent) {
  EXPECT_NEAR(measured_region({.locations = measured_locations(merge_locations(test::exact_input()))})
                  .share_outside(),
              1 - 0.99 * 0.95, 1e-9);
}

TEST(MeasuredRegion, HatchingCoversWhatIsOutsideAndNothingElse) {
  const MeasuredRegion region({{0, 0}, {0.6, 0.64}, {0.6, -0.64}, {0, 0.95}});
  double length = 0;
  const double apart = 0.01;
  for (const std::vector<TunnelPoint>& line : hatching(region, apart)) {
    ASSERT_EQ(line.size(), 2u);
    const TunnelPoint middle{(line[0].y_norm + line[1].y_norm) / 2, (line[0].z_norm + line[1].z_norm) / 2};
    EXPECT_FALSE(region.holds(middle));
    for (const TunnelPoint& end : line)
      EXPECT_LE(std::max(std::abs(end.y_norm), std::abs(end.z_norm)), 1 + 1e-12);
    length += std::hypot(line[1].y_norm - line[0].y_norm, line[1].z_norm - line[0].z_norm);
  }
  EXPECT_NEAR(length * apart, 4 * region.share_outside(), 0.01) << "as much area as there is outside";
}

TEST(MeasuredRegion, IsInTheFileAndInThePictures) {
  const test::TemporaryFolder folder;
  const MapInput input =
      test::only(test::published_input(1), {"OT", "H0V2", "H0V-2", "H2V0", "H2V2", "H2V-2"});
  const DisturbanceMap map = disturbance_map(fit_maps(input), 5, "{}");
  const auto json = nlohmann::json::parse(format_disturbance_map(map));
  EXPECT_EQ(json["measured_region"],
            nlohmann::json::parse("[[-0.4,-0.64],[0.4,-0.64],[0.4,0.64],[-0.4,0.64]]"));
  const DisturbanceMap read = parse_disturbance_map(format_disturbance_map(map), "map.json");
  EXPECT_EQ(measured_region(read).corners().size(), 4u);
  Picture picture{.grid = map.grid, .values = map.delta_ct.value_percent, .geometry = map.geometry};
  EXPECT_THAT(gnuplot_script(picture, "p"), testing::Not(HasSubstr("$hatching")));
  picture.hatching = hatching(measured_region(map), 0.05);
  const std::string script = gnuplot_script(picture, "p");
  EXPECT_THAT(script, HasSubstr("$hatching with lines"));
  EXPECT_THAT(script, HasSubstr("hatched: beyond the locations"));
  write_maps(folder.path(), fit_maps(input), {.nodes = 5});
  EXPECT_THAT(read_text(folder / "delta_ct.svg"), HasSubstr("hatched: beyond the locations"));
}

}  // namespace
}  // namespace tunnelrig
