// What the values of a condition let one see.
#include "analysis/residual/observations/condition_values.h"

#include <limits>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

Covariate of_values(const std::string& name, const std::vector<double>& values) {
  return {name, Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values))};
}

/// Wherever in the order of the rows a value is missing.
TEST(ConditionValues, OneValueIsConstantThoughRowsLackIt) {
  for (const std::string name : {"supply_voltage_V", "belt_tension_N"}) {
    EXPECT_TRUE(is_constant(of_values(name, {kAbsent, 15, 15})));
    EXPECT_TRUE(is_constant(of_values(name, {15, 15, kAbsent})));
    EXPECT_FALSE(is_constant(of_values(name, {kAbsent, 15, 16})));
    EXPECT_FALSE(is_constant(of_values(name, {16, kAbsent, 15})));
  }
  EXPECT_TRUE(is_constant(of_values("supply_voltage_V", {kAbsent, kAbsent})));
  EXPECT_TRUE(is_constant(of_values("supply_voltage_V", {15, 15 * (1 + 1e-12)}))) << "rounding";
}

/// In open space there is no distance to the ground, and in the tunnel there is.
TEST(ConditionValues, ADistanceThatIsAbsentInSomeRowsVaries) {
  const std::string ground(kGroundDistance);
  EXPECT_FALSE(is_constant(of_values(ground, {kAbsent, 2, 2})));
  EXPECT_FALSE(is_constant(of_values(ground, {2, 2, kAbsent})));
  EXPECT_TRUE(is_constant(of_values(ground, {2, 2})));
  EXPECT_TRUE(is_constant(of_values(ground, {kAbsent, kAbsent})));
}

}  // namespace
}  // namespace tunnelrig
