// The map's interpolation: symmetric to the last bit, smooth, exact at the nodes, right in between.
#include "datasets/published_field.h"
#include "flight/vehicle/disturbance_field.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

TEST(DisturbanceField, AgreesWithTheFieldItWasMadeOf) {
  const DisturbanceField field(published_disturbance_map());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1, 1);
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const double y = place(random), z = place(random);
    const Disturbance here = field.at(y, z);
    worst = std::max({worst, std::abs(here.thrust_change - published_thrust_change(y, z)),
                      std::abs(here.uneven - published_uneven_thrust(y, z))});
  }
  EXPECT_LT(worst, 5e-4) << "the field's changes are of 5e-2";
}

TEST(DisturbanceField, IsExactAtNodesAndZeroAtTheOrigin) {
  const DisturbanceMap map = published_disturbance_map();
  const DisturbanceField field(map);
  for (std::size_t row = 0; row < map.grid.z_norm.size(); ++row) {
    for (std::size_t column = 0; column < map.grid.y_norm.size(); ++column) {
      const Disturbance here = field.at(map.grid.y_norm[column], map.grid.z_norm[row]);
      EXPECT_NEAR(100 * here.thrust_change, map.delta_ct.value_percent[map.grid.index(row, column)], 1e-9);
      EXPECT_NEAR(100 * here.uneven, map.uneven_thrust.value_percent[map.grid.index(row, column)], 1e-9);
    }
  }
  EXPECT_NEAR(field.at(0, 0).thrust_change, 0, 1e-12);
}

TEST(DisturbanceField, IsMirroredToTheLastBitAndHeldOutside) {
  const DisturbanceField field(published_disturbance_map());
  std::mt19937 random(8);
  std::uniform_real_distribution<double> place(-1.3, 1.3);
  for (int i = 0; i < 1000; ++i) {
    const double y = place(random), z = place(random);
    const Disturbance right = field.at(y, z), left = field.at(-y, z);
    EXPECT_EQ(right.thrust_change, left.thrust_change);
    EXPECT_EQ(right.uneven, -left.uneven);
    const Disturbance held = field.at(std::clamp(y, -1.0, 1.0), std::clamp(z, -1.0, 1.0));
    EXPECT_EQ(right.thrust_change, held.thrust_change);
    EXPECT_EQ(DisturbanceField::outside(y, z), std::abs(y) > 1 || std::abs(z) > 1);
  }
  EXPECT_EQ(field.at(0, 0.7).uneven, 0);
}

/// One percentage point of standard uncertainty: so wrong the map is, but not everywhere in the same
/// direction, which would be a constant force that any integral removes.
TEST(DisturbanceField, IsWrongByItsUncertaintyInPlacesOfBothSigns) {
  DisturbanceMap map = published_disturbance_map();
  map.grid = {};
  for (int i = -4; i <= 4; ++i) {  // hundreds of finer ones would take seconds
    map.grid.y_norm.push_back(0.25 * i);
    map.grid.z_norm.push_back(0.25 * i);
  }
  for (MapLayer* layer : {&map.delta_ct, &map.uneven_thrust}) {
    layer->value_percent.assign(map.grid.nodes(), 0);
    layer->u95_percent.assign(map.grid.nodes(), map.coverage_factor);
  }
  Random random(9);
  constexpr int kDraws = 400;
  double squares = 0;
  int differ_far = 0, differ_near = 0;
  for (int i = 0; i < kDraws; ++i) {
    const MapError thrust(1, random), uneven(1, random);
    const DisturbanceField field(map, 1, thrust, uneven);
    const double here = field.at(0.2, -0.8).thrust_change, far = field.at(0.9, 0.8).thrust_change,
                 near = field.at(0.25, -0.8).thrust_change;
    squares += here * here / kDraws;
    differ_far += here * far < 0 ? 1 : 0;
    differ_near += here * near < 0 ? 1 : 0;
  }
  EXPECT_NEAR(std::sqrt(squares), 0.01, 0.001);
  EXPECT_GT(differ_far, 0.4 * kDraws);
  EXPECT_LT(differ_near, 0.1 * kDraws);
}

TEST(DisturbanceField, HasNoKinks) {
  const DisturbanceField field(published_disturbance_map());
  constexpr double kStep = 1e-4;
  // The slope's change over a node against that within a cell: of the same size where the field is twice
  // differentiable.
  for (const double node : {-0.5, -0.05, 0.3, 0.75}) {
    const auto slope = [&](double z) {
      return (field.at(0.6, z + kStep).thrust_change - field.at(0.6, z).thrust_change) / kStep;
    };
    EXPECT_NEAR(slope(node), slope(node - kStep), 2e-3);
  }
}

}  // namespace
}  // namespace tunnelrig
