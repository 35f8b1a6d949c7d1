// What two conditions do together and neither does alone.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using test::explained;
using testing::AnyOf;

struct Products : testing::Test {
  std::mt19937_64 random{test::seed()};

  Observations observations(int channels = 4) {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(16, 8), .groups = 6, .channels = channels, .session_ratio = 0.4},
        random);
    test::add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
    test::add_covariate(o, "belt_tension_N", 20, 60, random);
    return o;
  }

  static VectorXd from_mean(const Observations& o, const std::string& name) {
    const VectorXd x = o.find(name)->value.col(0);
    return x.array() - x.mean();
  }

  static void add_product(Observations& o, double size) {
    const VectorXd product = from_mean(o, "supply_voltage_V").cwiseProduct(from_mean(o, "belt_tension_N"));
    const double rms = std::sqrt(product.squaredNorm() / static_cast<double>(product.size()));
    test::set_y(o, o.y.colwise() + size / rms * product);
  }
};

/// At the mean of either the other does nothing: no curve over one of them can say it.
TEST_F(Products, WhatTwoConditionsDoTogetherIsFound) {
  Observations o = observations();
  add_product(o, 0.003);
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "unknown");
  ASSERT_EQ(e.unknown.size(), 1u);
  const UnknownStructure& found = e.unknown[0];
  EXPECT_EQ(found.covariate, "supply_voltage_V");
  EXPECT_EQ(found.times, "belt_tension_N");
  EXPECT_EQ(found.place, "");
  EXPECT_GT(found.shape.back().y, 0);
  EXPECT_LT(found.shape.front().y, 0);
  EXPECT_NEAR(found.shape.back().y - found.shape.front().y, 2 * found.amplitude, 1e-12);
  EXPECT_THAT(explanation_text(e),
              testing::HasSubstr("in proportion to how far belt_tension_N is from its mean"));
  const auto written = nlohmann::json::parse(explanation_json(e))["unknown"][0];
  EXPECT_EQ(written["times"], "belt_tension_N");
  EXPECT_TRUE(written["place"].is_null());
}

TEST_F(Products, AreFoundInTablesToo) {
  Observations o = observations(1);
  add_product(o, 0.006);
  const Explanation e = explained(o);
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].times, "belt_tension_N");
}

TEST_F(Products, OneConditionAloneIsNotTakenForTwo) {
  Observations o = observations();
  test::add_effect(o, "supply_voltage", {0.3});
  const VectorXd tension = from_mean(o, "belt_tension_N") / 20;
  test::set_y(o, o.y.colwise() + VectorXd(0.005 * tension.array().cube()));
  const Explanation e = explained(o);
  ASSERT_EQ(e.adopted.size(), 1u);
  EXPECT_EQ(e.adopted[0].term.effect->name, "supply_voltage");
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].covariate, "belt_tension_N");
  EXPECT_EQ(e.unknown[0].times, "");
}

/// Propellers each with a slope of its own: any number written beside them would have a product with it, as
/// far as rows are counted.
TEST_F(Products, SlopesOfTheGroupsOwnGoWithNothingThatIsWrittenBesideThem) {
  constexpr int kGroups = 12, kTables = 10;
  std::normal_distribution<double> normal;
  const auto is_product_with_batch = [](const UnknownStructure& u) {
    return u.times == "batch" || (u.covariate == "batch" && !u.times.empty());
  };
  int with_random = 0, with_true = 0;
  for (int table = 0; table < kTables; ++table)
    for (const bool follows : {false, true}) {
      Observations o = test::simulate({.runs_of_block = std::vector<int>(16, 12), .groups = kGroups}, random);
      test::add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
      VectorXd batch(kGroups), slope(kGroups);
      for (int g = 0; g < kGroups; ++g) {
        batch(g) = normal(random);
        slope(g) = 0.008 * (follows ? batch(g) + 0.3 * normal(random) : normal(random));
      }
      Covariate beside{"batch", VectorXd(o.rows())};
      VectorXd added = from_mean(o, "supply_voltage_V");
      for (Index row = 0; row < o.rows(); ++row) {
        const int group = o.group[static_cast<std::size_t>(row)];
        beside.value(row, 0) = batch(group);
        added(row) *= slope(group);
      }
      o.covariates.push_back(beside);
      test::set_y(o, o.y + added);
      (follows ? with_true : with_random) += std::ranges::any_of(explained(o).unknown, is_product_with_batch);
    }
  EXPECT_LE(with_random, 1);
  EXPECT_GE(with_true, 8);
}

TEST_F(Products, OfConditionsThatGoTogetherAreNotTried) {
  Observations o = observations();
  Covariate twin = *o.find("belt_tension_N");
  twin.name = "twin_N";
  twin.value = 3 * twin.value.array() + 1;
  o.covariates.push_back(twin);
  int products = 0;
  for (const Curve& curve : curves_to_try(o, o.all_rows())) {
    if (!curve.strength) continue;
    ++products;
    EXPECT_FALSE(curve.covariate == "belt_tension_N" && curve.times() == "twin_N");
    EXPECT_NEAR(curve.place.weight.cwiseAbs().maxCoeff(), 1, 1e-12);
    EXPECT_NEAR(curve.place.weight.mean(), 0, 1e-12);
  }
  EXPECT_GE(products, 2);
}

/// A cable comes loose in the midst of a campaign, and sags with the battery from then on: half of that over
/// all runs is not what happened.
TEST_F(Products, WhatOneConditionDoesFromSomeRunOnIsFound) {
  constexpr int kCampaigns = 4;
  int found = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations();
    o.covariates.push_back(
        {"run_order", VectorXd::LinSpaced(o.rows(), 1, static_cast<double>(o.rows())), true});
    VectorXd late = from_mean(o, "supply_voltage_V");
    late.head(late.size() / 2).setZero();
    test::set_y(o, o.y.colwise() + 0.02 * late);
    const Explanation e = explained(o);
    EXPECT_NE(e.verdict, "explained") << explanation_text(e);
    found += std::ranges::any_of(e.unknown, [](const UnknownStructure& unknown) {
      return unknown.covariate == "supply_voltage_V" && unknown.times == "run_order";
    });
  }
  EXPECT_GE(found, kCampaigns - 1);
}

}  // namespace
}  // namespace tunnelrig
