// The thesis's claims about the field (thesis_facts: each one a test of a map), here on the field that the
// virtual rig measures.
#include "datasets/published_field.h"

#include "datasets/locations.h"
#include "support/field_claims.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

TEST(PublishedField, SatisfiesEveryClaim) {
  test::expect_thesis_claims([](double y, double z) { return 100 * published_thrust_change(y, z); },
                             [](double y, double z) { return 100 * published_uneven_thrust(y, z); });
}

TEST(PublishedField, SharesAddUpToTheTotalAndToU) {
  const auto shares = rotor_shares(-0.03);
  EXPECT_NEAR(shares[0] + shares[1] + shares[2] + shares[3], 1, 1e-15);
  EXPECT_NEAR(shares[0] + shares[3] - shares[1] - shares[2], -0.03, 1e-15);  // (5.1)
}

TEST(PublishedField, OpenSpaceNumbers) {
  EXPECT_NEAR(published_ceiling_ratio(6), 1.01, 0.001);
  EXPECT_GT(published_ceiling_ratio(0.75), published_ceiling_ratio(2));
  EXPECT_GT(published_ground_ratio(0.75), 1.03);
  double lowest = 2, at = 0;
  for (int step = 0; step <= 105; ++step) {
    const double z = 0.75 + 0.05 * step;
    if (published_ground_ratio(z) < lowest) {
      lowest = published_ground_ratio(z);
      at = z;
    }
  }
  EXPECT_TRUE(at > 1.2 && at < 4) << "the local minimum of 4.21 is at " << at;
  EXPECT_NEAR(published_ground_ratio(6), 1, 0.003);
}

}  // namespace
}  // namespace tunnelrig
