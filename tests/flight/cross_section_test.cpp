#include "flight/tunnel/cross_section.h"

#include "flight/tunnel/shapes.h"
#include "support/message_of.h"
#include "support/seeds.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

const CrossSection kSquare(box_outline(1.5, 1.5));

/// A box with a cable tray on the right wall and a refuge bay in the left one.
CrossSection furnished() {
  return CrossSection(
      with_features(box_outline(2, 3), {{1, 1.0, 1.4, 0.2}, {3, 0.5, 2.5, -0.6}}, "furnished"));
}

TEST(CrossSection, ContainsWhatIsInside) {
  EXPECT_TRUE(kSquare.contains({0.74, -0.74}));
  EXPECT_FALSE(kSquare.contains({0.76, 0}));
  const CrossSection section = furnished();
  EXPECT_FALSE(section.contains({0.9, -0.3}));   // in the tray
  EXPECT_TRUE(section.contains({0.7, -0.3}));    // beside it
  EXPECT_TRUE(section.contains({-1.5, 0}));      // in the bay
  EXPECT_FALSE(section.contains({-1.5, -1.2}));  // below it
}

TEST(CrossSection, DirectionOfTheVerticesDoesNotMatter) {
  auto outline = box_outline(2, 1);
  std::reverse(outline.begin(), outline.end());
  const CrossSection section(outline);
  EXPECT_DOUBLE_EQ(section.ray({0.5, 0}, {1, 0}), 0.5);
  EXPECT_NEAR(section.clearance({0.8, 0}), 0.2, 1e-12);
}

TEST(CrossSection, NearestWallOfASquare) {
  const NearestWall wall = kSquare.nearest_wall({0.6, 0.1});
  EXPECT_NEAR(wall.distance_m, 0.15, 1e-12);
  EXPECT_EQ(wall.edge, 1U);
  EXPECT_TRUE(wall.point.isApprox(SectionPoint(0.75, 0.1)));
}

TEST(CrossSection, ClearanceOfARolledBar) {
  const double roll = 0.3;
  const Bar tips = bar({0.2, 0.4}, 0.9, roll);
  EXPECT_NEAR((tips.right - tips.left).norm(), 0.9, 1e-12);
  EXPECT_GT(tips.right.y(), tips.left.y());  // a positive roll lifts the right side
  const double to_wall = 0.75 - (0.2 + 0.45 * std::cos(roll));
  const double to_ceiling = 0.75 - (0.4 + 0.45 * std::sin(roll));
  EXPECT_NEAR(kSquare.clearance(tips.left, tips.right), std::min(to_wall, to_ceiling), 1e-12);

  const Bar through = bar({0.4, 0}, 0.9, 0);
  EXPECT_NEAR(kSquare.clearance(through.left, through.right), -0.1, 1e-12);
  // Both ends are free, but a tray stands between them.
  const CrossSection section = furnished();
  EXPECT_EQ(section.clearance({0.95, -0.6}, {0.95, 0.05}), 0);
  EXPECT_GT(section.clearance({0.7, -0.6}, {0.7, 0.05}), 0.09);
}

TEST(CrossSection, RaysMeetTheWallThatTheyShould) {
  EXPECT_DOUBLE_EQ(kSquare.ray({0.25, 0}, {1, 0}), 0.5);
  EXPECT_DOUBLE_EQ(kSquare.ray({0.25, 0}, {0.5, 0}), 1);  // in lengths of the direction
  EXPECT_NEAR(kSquare.ray({0, 0}, {1, 1}), 0.75, 1e-12);  // into a corner
  EXPECT_TRUE(std::isinf(kSquare.ray({0, 0}, {0, 0})));
  EXPECT_NEAR(furnished().ray({0, -0.3}, {1, 0}), 0.8, 1e-12);
  EXPECT_NEAR(furnished().ray({0, 0}, {-1, 0}), 1.6, 1e-12);
}

/// From anywhere inside, along any direction: the end is on the wall and all before it inside.
TEST(CrossSection, RandomRaysEndOnTheWall) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const CrossSection& section :
       {kSquare, furnished(), CrossSection(arch_outline(4.5, 5, 2.75)), CrossSection(circle_outline(2))}) {
    int tried = 0;
    while (tried < 500) {
      const SectionPoint from(section.highest().x() * uniform(random),
                              section.highest().y() * uniform(random));
      if (!section.contains(from)) continue;
      ++tried;
      const double angle = std::numbers::pi * uniform(random);
      const SectionPoint direction(std::cos(angle), std::sin(angle));
      const double range = section.ray(from, direction);
      ASSERT_TRUE(std::isfinite(range));
      EXPECT_LT(section.nearest_wall(from + range * direction).distance_m, 1e-9);
      for (const double part : {0.2, 0.5, 0.8, 0.999})
        EXPECT_TRUE(section.contains(from + part * range * direction)) << from.transpose() << " " << angle;
    }
  }
}

TEST(CrossSection, CircleHasTheCirclesArea) {
  const CrossSection circle(circle_outline(2, 72));
  double twice = 0;
  const auto vertices = circle.vertices();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const SectionPoint& a = vertices[i];
    const SectionPoint& b = vertices[(i + 1) % vertices.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  EXPECT_NEAR(twice / 2, std::numbers::pi, 1e-12);
}

TEST(CrossSection, RefusesWhatIsNoSection) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of([] { CrossSection({{0, 0}, {1, 0}}, "x.toml"); }), HasSubstr("x.toml: 2 vertices"));
  EXPECT_THAT(message_of([&] { CrossSection({{0, 0}, {1, 0}, {nan, 1}}); }), HasSubstr("vertex 3"));
  EXPECT_THAT(message_of([] { CrossSection({{0, 0}, {1, 0}, {0, 1e6}}); }), HasSubstr("within 1000 m"));
  EXPECT_THAT(message_of([] { CrossSection({{0, 0}, {1, 0}, {1, 1}, {0, 0}}); }), HasSubstr("closer than"));
  EXPECT_THAT(message_of([] {
                CrossSection({{0, 0}, {1, 1}, {1, 0}, {0, 1}});
              }),
              HasSubstr("cross or touch"));
  EXPECT_THAT(message_of([] { CrossSection({{0, 0}, {2, 0}, {1, 0}, {1, 1}}); }), HasSubstr("fold"));
  EXPECT_THAT(message_of([] { CrossSection({{0, 0}, {1, 0}, {2, 0}}); }), HasSubstr("fold"));
}

}  // namespace
}  // namespace tunnelrig
