// Conditions that do different things in different places of the tunnel.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <set>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::explained;

struct Places : testing::Test {
  std::mt19937_64 random{test::seed()};

  /// Five places in the tunnel, each at another height, and open space.
  Observations observations() {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(16, 8), .groups = 6, .channels = 4, .session_ratio = 0.4}, random);
    test::add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
    test::add_covariate(o, "tunnel_airspeed_m_s", 0, 0.4, random);
    VectorXd tunnel(o.rows()), y(o.rows()), z(o.rows());
    for (Index row = 0; row < o.rows(); ++row) {
      const int group = o.group[static_cast<std::size_t>(row)];
      tunnel(row) = group < 5 ? 1 : 0;
      y(row) = group < 5 ? 0.2 * group : 0;
      z(row) = group < 5 ? 0.5 * group - 1 : 0;
    }
    o.places = {{"tunnel", tunnel}, {"y_norm", y}, {"z_norm", z}, {"|y_norm|", y.cwiseAbs()}};
    return o;
  }

  static void add(Observations& o, const VectorXd& change) { test::set_y(o, o.y.colwise() + change); }

  static VectorXd volts(const Observations& o) {
    return o.find("supply_voltage_V")->value.col(0).array() - 16;
  }
};

/// One of six groups is outside: what is the same there is not the tunnel's.
TEST_F(Places, WhatIsAlikeEverywhereIsNoMatterOfThePlace) {
  constexpr int kCampaigns = 4;
  int everywhere = 0;
  for (int campaign = 0; campaign < kCampaigns; ++campaign) {
    Observations o = observations();
    test::add_covariate(o, "pitch_mrad", -1, 1, random);
    add(o, 0.004 * o.find("pitch_mrad")->value.col(0));
    const Explanation e = explained(o);
    ASSERT_FALSE(e.unknown.empty()) << explanation_text(e);
    EXPECT_EQ(e.unknown[0].covariate, "pitch_mrad");
    everywhere += e.unknown[0].place.empty() ? 1 : 0;
  }
  EXPECT_GE(everywhere, kCampaigns - 1);
}

/// Above and below the middle in opposite directions: no name and no curve for all places alike can say it.
TEST_F(Places, WhatIsOppositeAboveAndBelowIsFound) {
  Observations o = observations();
  add(o, 0.01 * o.places[2].weight.cwiseProduct(volts(o)));
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "unknown");
  ASSERT_EQ(e.unknown.size(), 1u);
  const UnknownStructure& found = e.unknown[0];
  EXPECT_EQ(found.covariate, "supply_voltage_V");
  EXPECT_EQ(found.place, "z_norm");
  EXPECT_EQ(found.rotor, -1);
  // 0.5 % of 7 N to either side of the middle, at z_norm = 1
  EXPECT_NEAR(found.amplitude, 0.005 * o.value.mean(), 0.3 * 0.005 * o.value.mean());
  EXPECT_GT(found.shape.back().y, found.shape.front().y);
  EXPECT_THAT(explanation_text(e), testing::HasSubstr("in proportion to z_norm of the location"));
  EXPECT_EQ(nlohmann::json::parse(explanation_json(e))["unknown"][0]["place"], "z_norm");
}

TEST_F(Places, AnEffectThatIsAlikeEverywhereHasNoPlace) {
  Observations o = observations();
  test::add_effect(o, "supply_voltage", {0.3});
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "explained");
  EXPECT_TRUE(e.unknown.empty());
}

TEST_F(Places, AnEffectOfTheTunnelOnlyIsNotCalledOneOfEverywhere) {
  Observations o = observations();
  add(o, 0.02 * o.places[0].weight.cwiseProduct(volts(o)));
  const Explanation e = explained(o);
  ASSERT_FALSE(e.unknown.empty());
  EXPECT_EQ(e.unknown[0].covariate, "supply_voltage_V");
  EXPECT_EQ(e.unknown[0].place, "tunnel");
}

TEST_F(Places, OfOneSideOnlyAreNotTriedTwice) {
  const Observations o = observations();
  std::set<std::string> tried;
  for (const Curve& curve : curves_to_try(o, o.all_rows())) tried.insert(curve.place.name);
  EXPECT_THAT(tried,
              testing::AllOf(testing::Contains("y_norm"), testing::Not(testing::Contains("|y_norm|"))));
}

/// Even one whose columns are called like a campaign's.
TEST(PlacesOfTables, AreNone) {
  std::mt19937_64 random{test::seed()};
  std::uniform_real_distribution<double> even;
  std::string csv = "day,location,y_norm,z_norm,V,y\n";
  for (int row = 0; row < 96; ++row)
    csv += fmt::format("{},H{}V0,{},{},{},{}\n", row / 8, row % 5, 0.2 * (row % 5), 0.5 * (row % 5) - 1,
                       15.5 + even(random), 7 + 0.01 * even(random));
  const Observations o = observe_table(
      read_observations(parse_csv(csv, "t.csv"),
                        parse_table_schema("format = \"tunnelrig-table/1\"\ngroups = [\"location\"]\n"
                                           "blocks = \"day\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                                           "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\n"
                                           "meaning = \"supply_voltage_V\"\n",
                                           "s.toml")),
      {});
  const std::vector<Curve> curves = curves_to_try(o, o.all_rows());
  ASSERT_FALSE(curves.empty());
  for (const Curve& curve : curves) EXPECT_EQ(curve.in_place(), "");
}

}  // namespace
}  // namespace tunnelrig
