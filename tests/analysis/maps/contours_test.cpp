#include "analysis/maps/contours.h"

#include "analysis/maps/contour_labels.h"
#include "analysis/maps/tunnel_maps.h"
#include "support/seeds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<double> on_grid(const MapGrid& grid, const std::function<double(double, double)>& field) {
  std::vector<double> values;
  for (const double z : grid.z_norm) {
    for (const double y : grid.y_norm) values.push_back(field(y, z));
  }
  return values;
}

/// Linear interpolation along the grid's edge that the point is on; bilinear where it is on none.
double interpolated(const MapGrid& grid, const std::vector<double>& values, const TunnelPoint& point) {
  const auto cell = [](const std::vector<double>& axis, double x) {
    const auto above = std::upper_bound(axis.begin() + 1, axis.end() - 1, x);
    return static_cast<std::size_t>(above - axis.begin()) - 1;
  };
  const std::size_t column = cell(grid.y_norm, point.y_norm), row = cell(grid.z_norm, point.z_norm);
  const double s = (point.y_norm - grid.y_norm[column]) / (grid.y_norm[column + 1] - grid.y_norm[column]);
  const double t = (point.z_norm - grid.z_norm[row]) / (grid.z_norm[row + 1] - grid.z_norm[row]);
  const auto value = [&](std::size_t r, std::size_t c) { return values[grid.index(r, c)]; };
  return (1 - t) * ((1 - s) * value(row, column) + s * value(row, column + 1)) +
         t * ((1 - s) * value(row + 1, column) + s * value(row + 1, column + 1));
}

bool on_border(const TunnelPoint& point) {
  return std::abs(point.y_norm) == 1 || std::abs(point.z_norm) == 1;
}

/// Twice the area that a closed line encloses; positive where it runs counter-clockwise.
double area(const ContourLine& line) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
    sum +=
        line.points[i].y_norm * line.points[i + 1].z_norm - line.points[i + 1].y_norm * line.points[i].z_norm;
  }
  return sum;
}

TEST(Contours, AHillHasOneClosedLineRoundIt) {
  const MapGrid grid = regular_grid(41);
  const auto hill = [](double y, double z) { return 1 - (y - 0.1) * (y - 0.1) - z * z; };
  const std::vector<ContourLine> lines = contour_lines(grid, on_grid(grid, hill), 0.75);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_TRUE(lines[0].closed());
  EXPECT_GT(area(lines[0]), 0);  // the top on the left
  EXPECT_NEAR(area(lines[0]) / 2, 0.25 * M_PI, 0.005);
  for (const TunnelPoint& point : lines[0].points) {
    EXPECT_NEAR(std::hypot(point.y_norm - 0.1, point.z_norm), 0.5, 0.002);
  }
  const auto hole = [&](double y, double z) { return -hill(y, z); };
  const std::vector<ContourLine> round_hole = contour_lines(grid, on_grid(grid, hole), -0.75);
  ASSERT_EQ(round_hole.size(), 1u);
  EXPECT_LT(area(round_hole[0]), 0);
}

TEST(Contours, ASlopeHasOneOpenLineWithTheHigherValuesOnItsLeft) {
  const MapGrid grid = regular_grid(21);
  const auto lines = contour_lines(grid, on_grid(grid, [](double y, double) { return y; }), 0.33);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_FALSE(lines[0].closed());
  EXPECT_EQ(lines[0].points.size(), 21u);
  EXPECT_GT(lines[0].points.front().z_norm, lines[0].points.back().z_norm);  // downwards: left is +y
}

TEST(Contours, ALevelThroughNodesIsOneLineWithoutRepeatedPoints) {
  const MapGrid grid = regular_grid(21);
  const auto lines = contour_lines(grid, on_grid(grid, [](double y, double z) { return y * (2 + z); }), 0);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].points.size(), 21u);
  for (const TunnelPoint& point : lines[0].points) EXPECT_EQ(point.y_norm, 0);
}

TEST(Contours, TheMiddleOfASaddleDecides) {
  const MapGrid grid{{-1, 0, 1}, {-1, 0, 1}};
  // The lower left cell has high corners at the origin and at (−1, −1), two low ones, and nothing else is
  // high.
  const auto lines = [&](double corner) {
    return contour_lines(grid, {corner, 0, 0, 0, 1, 0, 0, 0, 0}, 0.5);
  };
  const auto apart = lines(0.9);  // mean 0.475
  ASSERT_EQ(apart.size(), 2u);
  EXPECT_FALSE(apart[0].closed());
  EXPECT_TRUE(apart[1].closed());
  const auto joined = lines(1.1);  // mean 0.525
  ASSERT_EQ(joined.size(), 1u);
  EXPECT_FALSE(joined[0].closed());
}

TEST(Contours, HoldOnAnyField) {
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  const MapGrid grid = regular_grid(15);
  for (int trial = 0; trial < 300; ++trial) {
    // rough on purpose, many saddles; every other one with values that are just the level
    const auto values = on_grid(grid, [&](double, double) {
      const double value = normal(engine);
      return trial % 2 == 0 ? value : std::round(value);
    });
    const double level = trial % 2 == 0 ? 0.3 : 0;
    std::size_t crossings = 0;
    for (const ContourLine& line : contour_lines(grid, values, level)) {
      ASSERT_GE(line.points.size(), 2u);
      crossings += line.points.size() - (line.closed() ? 1 : 0);
      if (!line.closed()) {
        EXPECT_TRUE(on_border(line.points.front()));
        EXPECT_TRUE(on_border(line.points.back()));
      }
      for (const TunnelPoint& point : line.points)
        EXPECT_NEAR(interpolated(grid, values, point), level, 1e-9);
    }
    if (trial % 2 != 0) continue;
    std::size_t crossed_edges = 0;
    for (std::size_t row = 0; row < 15; ++row) {
      for (std::size_t column = 0; column < 15; ++column) {
        const bool high = values[grid.index(row, column)] >= level;
        if (column + 1 < 15) crossed_edges += high != (values[grid.index(row, column + 1)] >= level);
        if (row + 1 < 15) crossed_edges += high != (values[grid.index(row + 1, column)] >= level);
      }
    }
    EXPECT_EQ(crossings, crossed_edges);  // each once
  }
}

TEST(Contours, LevelsAreNiceAndWithinTheValues) {
  EXPECT_EQ(nice_step(0.11), 0.2);
  EXPECT_EQ(nice_step(0.21), 0.25);
  EXPECT_EQ(nice_step(3), 5);
  EXPECT_EQ(nice_step(60), 100);
  EXPECT_THAT(contour_levels({-0.25, 0.31}, 0.1), ElementsAre(-0.2, -0.1, 0, 0.1, 0.2, 0.3));
  EXPECT_FALSE(std::signbit(contour_levels({-0.25, 0.31}, 0.1)[2]));
  EXPECT_THAT(contour_levels({1, 2}, 1), IsEmpty());
  const MapGrid grid = regular_grid(3);
  EXPECT_THAT(contour_plot(grid, std::vector<double>(9, 1.5), 10), IsEmpty());
}

TEST(ContourLabels, StayClearOfBorderMarksAndEachOther) {
  const MapGrid grid = regular_grid(61);
  const auto values = on_grid(grid, [](double y, double z) { return 3 * z + std::cos(3 * y); });
  const std::vector<TunnelPoint> marks = {{0, 0}, {0.4, 0.32}, {0.8, -0.64}};
  const auto labels = place_labels(contour_plot(grid, values, 8), marks);
  ASSERT_GE(labels.size(), 5u);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    EXPECT_LT(std::abs(labels[i].at.y_norm), 0.9);
    EXPECT_NEAR(interpolated(grid, values, labels[i].at), labels[i].level, 1e-9);
    for (const TunnelPoint& mark : marks) {
      EXPECT_TRUE(std::abs(mark.y_norm - labels[i].at.y_norm) > 0.1 ||
                  std::abs(mark.z_norm - labels[i].at.z_norm) > 0.04);
    }
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_TRUE(std::abs(labels[j].at.y_norm - labels[i].at.y_norm) > 0.15 ||
                  std::abs(labels[j].at.z_norm - labels[i].at.z_norm) > 0.08);
    }
  }
}

}  // namespace
}  // namespace tunnelrig
