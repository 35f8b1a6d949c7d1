// An effect that does another thing within sessions than from one to the next.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Sessions at supplies of their own, which sag by tenths of a volt within: what is read of it scatters by
/// `reading_V`.
Explanation of_a_sagging_supply(double reading_V, std::mt19937_64& random) {
  constexpr double kLevels_V = 1.5, kSag_V = 0.15, kExponent = 1.8;
  std::normal_distribution<double> normal;
  Observations o = test::simulate(
      {.runs_of_block = std::vector<int>(16, 8), .groups = 3, .channels = 4, .session_ratio = 0.4}, random);
  VectorXd true_V(o.rows()), read_V(o.rows());
  double level_V = 0;
  for (Index row = 0; row < o.rows(); ++row) {
    if (row % 8 == 0) level_V = 16 + kLevels_V * normal(random);
    true_V(row) = level_V + kSag_V * normal(random);
    read_V(row) = true_V(row) + reading_V * normal(random);
  }
  test::set_y(o, o.y.colwise() + kExponent * (true_V.array() / 16).log().matrix());
  o.covariates.push_back({"supply_voltage_V", read_V});
  return test::explained(o);
}

bool says_so(const Explanation& e) {
  return std::ranges::any_of(e.warnings, [](const std::string& warning) {
    return warning.find("supply_voltage: its exponent is ") != std::string::npos &&
           warning.find("within sessions") != std::string::npos;
  });
}

TEST(WithinAndBetween, AConditionThatIsReadTooCoarselyIsSaid) {
  constexpr int kCampaigns = 12;
  std::mt19937_64 random(test::seed());
  int of_exact = 0, of_coarse = 0, named = 0;
  for (int k = 0; k < kCampaigns; ++k) {
    of_exact += says_so(of_a_sagging_supply(0, random));
    const Explanation coarse = of_a_sagging_supply(0.15, random);
    const bool is_named = std::ranges::any_of(
        coarse.adopted, [](const AdoptedEffect& a) { return a.term.label() == "supply_voltage"; });
    named += is_named;
    of_coarse += is_named && says_so(coarse);
  }
  EXPECT_LE(of_exact, 1);
  EXPECT_GE(named, 6);
  EXPECT_GE(of_coarse, named - 2);
}

/// Sessions that differ in a condition of no name, of which `share` is taken back by what else they differ
/// in.
Explanation of_a_bend(double share, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Observations o = test::simulate({.runs_of_block = std::vector<int>(18, 12), .session_ratio = 0.4}, random);
  VectorXd level(o.rows()), made(o.rows());
  double of_session = 0;
  for (Index row = 0; row < o.rows(); ++row) {
    if (row % 12 == 0) of_session = normal(random);
    level(row) = of_session + normal(random);
    made(row) = 0.02 * (std::cos(1.5 * level(row)) - share * std::cos(1.5 * of_session));
  }
  test::set_y(o, o.y.colwise() + made);
  o.covariates.push_back({"level", level});
  return test::explained(o);
}

TEST(WithinAndBetween, ACurveThatSomethingElseTakesBackIsDoubted) {
  constexpr int kCampaigns = 12;
  std::mt19937_64 random(test::seed());
  const auto says = [](const Explanation& e) {
    return std::ranges::any_of(e.warnings, [](const std::string& warning) {
      return warning.starts_with("what goes with level: within sessions it is ");
    });
  };
  int of_right = 0, of_taken_back = 0, seen = 0;
  for (int k = 0; k < kCampaigns; ++k) {
    of_right += says(of_a_bend(0, random));
    const Explanation e = of_a_bend(3, random);
    seen += !e.unknown.empty();
    of_taken_back += says(e);
  }
  EXPECT_LE(of_right, 1);
  EXPECT_GE(seen, 8);
  EXPECT_GE(of_taken_back, seen / 2);
}

}  // namespace
}  // namespace tunnelrig
