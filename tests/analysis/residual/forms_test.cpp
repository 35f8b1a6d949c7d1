// Forms of one effect: which one it is shows when what else is there is known.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <array>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// One rotor's image in the ground, and an exponential below the ceiling, in open space: heights of either
/// take turns.
Observations between_ground_and_ceiling(std::mt19937_64& random) {
  constexpr std::array<double, 5> kHeights_R = {0.75, 1, 1.5, 2, 3};
  Observations o =
      test::simulate({.runs_of_block = std::vector<int>(18, 12), .groups = 1, .channels = 4}, random);
  Covariate ground{"ground_distance_R", Eigen::MatrixXd::Constant(o.rows(), 1, kNaN)};
  Covariate ceiling{"ceiling_distance_R", Eigen::MatrixXd::Constant(o.rows(), 1, kNaN)};
  Eigen::MatrixXd y = o.y;
  for (Index row = 0; row < o.rows(); ++row) {
    const double height_R = kHeights_R[static_cast<std::size_t>(row / 2) % kHeights_R.size()];
    if (row % 2 == 0) {
      ground.value(row, 0) = height_R;
      y.row(row).array() -= std::log1p(-std::pow(0.25 / height_R, 2));
    } else {
      ceiling.value(row, 0) = height_R;
      y.row(row).array() += std::log1p(0.1 * std::exp(-height_R));
    }
  }
  o.covariates.push_back(ground);
  o.covariates.push_back(ceiling);
  test::set_y(o, y);
  return o;
}

TEST(Forms, AreChosenAnewBesideALaterEffect) {
  std::mt19937_64 random(test::seed());
  constexpr int kCampaigns = 8;
  int right = 0;
  for (int campaign = 0; campaign < kCampaigns; ++campaign) {
    const Explanation e = test::explained(between_ground_and_ceiling(random));
    std::vector<std::string> labels;
    for (const AdoptedEffect& adopted : e.adopted) labels.push_back(adopted.term.label());
    right += testing::Matches(testing::UnorderedElementsAre("ground_effect (image)",
                                                            "ceiling_effect (exponential)"))(labels)
                 ? 1
                 : 0;
  }
  EXPECT_GE(right, kCampaigns - 1);
}

}  // namespace
}  // namespace tunnelrig
