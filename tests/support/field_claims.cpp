#include "support/field_claims.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace tunnelrig::test {
namespace {

using Field = std::function<double(double, double)>;

constexpr std::array<double, 6> kY = {0, 0.2, 0.4, 0.6, 0.8, 0.99};
constexpr std::array<double, 7> kZ = {-0.95, -0.64, -0.32, 0, 0.32, 0.64, 0.95};

double spread_over_height(const Field& field, double y) {
  double lowest = 1e9, highest = -1e9;
  for (const double z : kZ) {
    lowest = std::min(lowest, field(y, z));
    highest = std::max(highest, field(y, z));
  }
  return highest - lowest;
}

double mean_over_height(const Field& field, double y) {
  double sum = 0;
  for (const double z : kZ) sum += field(y, z);
  return sum / kZ.size();
}

double row_sum(const Field& field, double z) {
  double sum = 0;
  for (const double y : kY) sum += std::abs(field(y, z));
  return sum;
}

void expect_thrust_claims(const Field& delta_ct, double slack) {
  EXPECT_NEAR(delta_ct(0, 0), 0, 1e-12);
  for (std::size_t i = 1; i < kZ.size(); ++i) {
    EXPECT_GT(delta_ct(0, kZ[i]), delta_ct(0, kZ[i - 1]) - slack)
        << "claim 1: C_T rises along H0, at z " << kZ[i];
  }
  EXPECT_GT(delta_ct(0, 0.95), 1) << "claim 1";
  EXPECT_LT(delta_ct(0, -0.95), -0.5) << "claim 1";

  double best = -1e9, best_y = 0, best_z = 0;
  for (const double y : kY) {
    for (const double z : kZ) {
      if (delta_ct(y, z) <= best) continue;
      best = delta_ct(y, z);
      best_y = y;
      best_z = z;
    }
  }
  EXPECT_EQ(best_z, 0.95) << "claim 2: the largest C_T is near the ceiling";
  EXPECT_TRUE(best_y >= 0.4 && best_y <= 0.8) << "claim 2: near H3, found at y " << best_y;
  EXPECT_LT(delta_ct(0.99, 0.95), best - 0.3) << "claim 2: the gain drops again at H5";

  const double near_wall = 0.8;
  EXPECT_NEAR(delta_ct(near_wall, 0), 0, 1.5) << "claim 3: OT's level at mid height";
  EXPECT_LT(delta_ct(near_wall, -0.64), -1) << "claim 3: falls towards the ground";
  EXPECT_GT(delta_ct(near_wall, -0.95), delta_ct(near_wall, -0.64)) << "claim 3: rises again at V-3";
  EXPECT_LT(delta_ct(near_wall, -0.95), 0) << "claim 3: but stays below OT";
  EXPECT_GT(mean_over_height(delta_ct, near_wall), mean_over_height(delta_ct, 0)) << "claim 4";
  const double widest = std::max({spread_over_height(delta_ct, 0.6), spread_over_height(delta_ct, 0.8),
                                  spread_over_height(delta_ct, 0.99)});
  for (const double y : {0.0, 0.2, 0.4})
    EXPECT_GT(widest, spread_over_height(delta_ct, y)) << "claim 4, against y " << y;
}

void expect_roll_claims(const Field& uneven, double slack) {
  for (const double z : kZ) EXPECT_NEAR(uneven(0, z), 0, 1e-12) << "claim 5: zero along H0";
  for (const double y : kY) {
    for (const double z : kZ) {
      if (y < 0.4) continue;
      EXPECT_LT(uneven(y, z), slack) << "claim 5: towards the wall, at " << y << ", " << z;
    }
  }
  double best = 0, best_z = 0;
  for (const double z : kZ) {
    if (row_sum(uneven, z) <= best) continue;
    best = row_sum(uneven, z);
    best_z = z;
  }
  EXPECT_TRUE(best_z == -0.32 || best_z == -0.64)
      << "claim 6: largest near V-1 to V-2, found at z " << best_z;
  for (const double z : {-0.32, -0.64}) {
    for (std::size_t i = 1; i < kY.size(); ++i) {
      EXPECT_LT(uneven(kY[i], z), uneven(kY[i - 1], z) + slack)
          << "claim 6: grows from H0 to H5, at y " << kY[i];
    }
  }
  EXPECT_LT(std::abs(uneven(0.8, -0.95)), 0.25 * std::abs(uneven(0.8, -0.64)))
      << "claim 6: close to zero at H4V-3";
  for (const double z : kZ) {
    if (z == 0) continue;
    EXPECT_GT(row_sum(uneven, z), row_sum(uneven, 0) - 6 * slack)
        << "claim 6: smallest along V0, against z " << z;
  }
}

}  // namespace

void expect_thesis_claims(const Field& delta_ct, const Field& uneven, double slack) {
  expect_thrust_claims(delta_ct, slack);
  expect_roll_claims(uneven, slack);
  double thrust_low = 0, thrust_high = 0, roll_low = 0, roll_high = 0;
  for (const double y : kY) {
    for (const double z : kZ) {
      EXPECT_NEAR(delta_ct(-y, z), delta_ct(y, z), 1e-12) << "claim 7";
      EXPECT_NEAR(uneven(-y, z), -uneven(y, z), 1e-12) << "claim 7";
      thrust_low = std::min(thrust_low, delta_ct(y, z));
      thrust_high = std::max(thrust_high, delta_ct(y, z));
      roll_low = std::min({roll_low, uneven(y, z), uneven(-y, z)});
      roll_high = std::max({roll_high, uneven(y, z), uneven(-y, z)});
    }
  }
  EXPECT_GT(thrust_high - thrust_low, roll_high - roll_low) << "claim 8";
}

}  // namespace tunnelrig::test
